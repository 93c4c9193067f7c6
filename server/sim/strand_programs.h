// StrandPrograms: one kernel compiled for the numbers of colliders that a scene may come to have, with the
// constants of its model set. From one thread with its GL context current.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <variant>

#include "common/gl/program.h"
#include "server/sim/solver_registry.h"
#include "server/sim/strand_layout.h"

namespace strandcast {

/// Whether the current context's device is a processor: shared memory is ordinary memory there, and barriers
/// cost more than the work between them.
bool is_software_device();

/// What a model's parameters are to its kernel: uniforms by name, the same in every step. What changes from
/// step to step is in the step's block (step_block.h).
using ModelConstants = std::map<std::string, std::variant<double, uint32_t>>;

struct KernelDesc {
  std::string shader_path;  // below shaders/
  gl::Variant variant;      // besides COLLIDERS and HAS_TURBULENCE
  ModelConstants constants;
  bool meets_air = true;  // false: it has no HAS_TURBULENCE
};

class StrandPrograms {
 public:
  StrandPrograms() = default;
  /// BadInput for a constant that the kernel does not declare; Internal or Unsupported when a variant does
  /// not compile.
  static Result<StrandPrograms> make(const gl::ShaderLibrary& shaders, const SceneFeatures& features,
                                     const KernelDesc& desc);

  /// The cheapest that can hold so many colliders; the largest when none can.
  const gl::Program& fitting(size_t collider_count) const;

 private:
  std::map<uint32_t, gl::Program> by_capacity_;
};

/// LimitExceeded when a dispatch needs more work groups than every GL 4.5 device accepts.
Status check_group_count(const StrandLayout& layout, uint32_t group_count);

}  // namespace strandcast

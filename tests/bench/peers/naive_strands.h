// Serial Dynamic Follow-The-Leader as Woodhouse 2017 first built it (its version `gpu`, 4.2): 64 bytes
// per particle side by side, one invocation per work group, one dispatch and barrier per stage. To show what
// the fused, vertex-major kernel of the row `dftl` is worth, stage by stage. Gravity and drag only.
#pragma once

#include <array>
#include <vector>

#include "common/gl/objects.h"
#include "common/gl/program.h"
#include "server/sim/solver.h"
#include "server/sim/strand_parameters.h"

namespace strandcast {

class NaiveStrands {
 public:
  static constexpr std::array<const char*, 3> kStages = {"prediction", "constraints", "velocities"};

  /// `shaders` holds naive_*.comp. Unsupported for more particles than a dispatch has groups.
  static Result<NaiveStrands> make(const Groom& groom, const StrandParameters& parameters,
                                   const gl::ShaderLibrary& shaders);

  /// One step; milliseconds of each stage, waiting for the device after each.
  std::array<double, kStages.size()> step_ms(double h_s);
  /// (vertex_count x strand_count), as SolverState.
  std::vector<glm::vec3> positions_m() const;
  uint64_t memory_bytes() const { return particles_.size_bytes(); }

 private:
  uint32_t strand_count_ = 0;
  uint32_t vertex_count_ = 0;
  StrandParameters parameters_;
  gl::Buffer particles_;
  std::array<gl::Program, kStages.size()> programs_;
};

}  // namespace strandcast

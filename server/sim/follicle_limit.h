// FollicleLimit: the pass that holds roots after each substep of whatever model ran on the GPU
// (shaders/sim/follicle_limit.comp). A strand leans from its groomed direction only as far as a follicle lets
// it; what hangs on its first free segment goes along. Strands whose tip is held too are left alone: their
// lengths could not be kept. From one thread with its GL context current.
#pragma once

#include "server/sim/strand_programs.h"
#include "server/sim/strand_state.h"

namespace strandcast {

/// Planes of a model that go along with strands that are moved, where it has them; null = it has none.
struct CarriedPlanes {
  const StrandPlane* way = nullptr;   // of every vertex in the last substep; world, m
  const StrandPlane* axis = nullptr;  // of every segment; world. Only with `way`
};

class FollicleLimit {
 public:
  /// Internal or Unsupported when it does not compile; LimitExceeded when there are too many strands for a
  /// dispatch.
  static Result<FollicleLimit> make(const gl::ShaderLibrary& shaders, const SceneFeatures& features,
                                    const StrandLayout& layout, const CarriedPlanes& carried);

  /// Whether this substep's strands are held: the input has a limit, and the strands have free tips.
  static bool holds(const StepInput& input, const StrandLayout& layout);
  /// Step block and strands are bound, and what wrote them is visible. Barriers are the caller's.
  void run(const StepInput& input, const StrandLayout& layout, const CarriedPlanes& carried) const;

 private:
  StrandPrograms programs_;
};

}  // namespace strandcast

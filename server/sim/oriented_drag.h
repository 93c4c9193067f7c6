// OrientedDrag: a pass that makes the drag of air smaller along a hair than across it, before each substep of
// any model (shaders/sim/oriented_drag.comp). Runs on its executor's thread.
#pragma once

#include <memory>

#include "server/sim/follicle_limit.h"

namespace strandcast {

class OrientedDrag {
 public:
  /// Makes the pass; errors as Executor::make_program(). `along_share`: drag along the hair relative to that
  /// across, 0..1. `way`: the model's plane of displacements in the last substep if its stored velocities
  /// differ from them; else null.
  static Result<OrientedDrag> make(Executor& executor, const SceneFeatures& features,
                                   const StrandLayout& layout, const StrandPlane* way, double along_share);

  /// Runs the pass before a substep; `strands` are the planes of the state.
  void run(const StepBlock& step, BoundPlanes strands, StrandPlane* way);
  uint64_t size_bytes() const { return program_->size_bytes(); }

 private:
  std::unique_ptr<KernelProgram> program_;
};

}  // namespace strandcast

// OrientedDrag: the pass that makes air drag hair less along its length than across, before each substep of
// whatever model's kernel (shaders/sim/oriented_drag.comp). From the thread of its executor.
#pragma once

#include <memory>

#include "server/sim/follicle_limit.h"

namespace strandcast {

class OrientedDrag {
 public:
  /// As Executor::make_program(). `along_share`: of the drag across, what there is along, 0..1. `way`: the
  /// model's plane of how every vertex moved in the last substep, where its stored velocities are not that;
  /// may be null.
  static Result<OrientedDrag> make(Executor& executor, const SceneFeatures& features,
                                   const StrandLayout& layout, const StrandPlane* way, double along_share);

  /// `strands`: the planes of the state, before the substep.
  void run(const StepBlock& step, BoundPlanes strands, StrandPlane* way);
  uint64_t size_bytes() const { return program_->size_bytes(); }

 private:
  std::unique_ptr<KernelProgram> program_;
};

}  // namespace strandcast

#include "server/sim/oriented_drag.h"

#include "common/kernels/strand_passes.h"

namespace strandcast {

Result<OrientedDrag> OrientedDrag::make(Executor& executor, const SceneFeatures& features,
                                        const StrandLayout& layout, const StrandPlane* way,
                                        double along_share) {
  const KernelDesc kernel = oriented_drag_kernel(along_share, way != nullptr);
  OrientedDrag drag;
  ASSIGN_OR_RETURN(drag.program_, executor.make_program(kernel, features, layout));
  return drag;
}

void OrientedDrag::run(const StepBlock& step, BoundPlanes strands, StrandPlane* way) {
  plane_of(strands, PlaneRole::Displacement) = way;
  program_->run(step, 0, strands);
}

}  // namespace strandcast

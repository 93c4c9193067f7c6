#include "server/sim/oriented_drag.h"

namespace strandcast {

Result<OrientedDrag> OrientedDrag::make(Executor& executor, const SceneFeatures& features,
                                        const StrandLayout& layout, const StrandPlane* way,
                                        double along_share) {
  KernelDesc kernel;
  kernel.shader_path = "sim/oriented_drag.comp";
  kernel.variant = {{"HAS_WAY", way != nullptr ? 1 : 0}};
  kernel.constants = {{"u_given_back", 1.0 - along_share}};
  kernel.meets_colliders = false;
  OrientedDrag drag;
  ASSIGN_OR_RETURN(drag.program_, executor.make_program(kernel, features, layout));
  return drag;
}

void OrientedDrag::run(const StepBlock& step, BoundPlanes strands, StrandPlane* way) {
  plane_of(strands, PlaneRole::Displacement) = way;
  program_->run(step, 0, strands);
}

}  // namespace strandcast

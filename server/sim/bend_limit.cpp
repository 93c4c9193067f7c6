#include "server/sim/bend_limit.h"

#include <glm/glm.hpp>

namespace strandcast {

BendAngles bend_angles(const BendLimitDesc& limits) {
  return {glm::radians(limits.least_root_deg), glm::radians(limits.least_tip_deg),
          glm::radians(limits.most_root_deg), glm::radians(limits.most_tip_deg)};
}

Result<BendLimit> BendLimit::make(Executor& executor, const SceneFeatures& features,
                                  const StrandLayout& layout, const CarriedPlanes& carried,
                                  const BendLimitDesc& limits) {
  const KernelDesc kernel = bend_limit_kernel(bend_angles(limits), carried.memory());
  BendLimit limit;
  ASSIGN_OR_RETURN(limit.program_, executor.make_program(kernel, features, layout));
  return limit;
}

void BendLimit::run(const StepBlock& step, BoundPlanes strands, const CarriedPlanes& carried) {
  plane_of(strands, PlaneRole::Displacement) = carried.way;
  plane_of(strands, PlaneRole::RodAxis) = carried.axis;
  program_->run(step, 0, strands);
}

}  // namespace strandcast

#include "server/sim/bend_limit.h"

#include <glm/glm.hpp>

namespace strandcast {

Result<BendLimit> BendLimit::make(Executor& executor, const SceneFeatures& features,
                                  const StrandLayout& layout, const CarriedPlanes& carried,
                                  const BendLimitDesc& limits) {
  KernelDesc kernel;
  kernel.shader_path = "sim/bend_limit.comp";
  kernel.variant = {{"MEMORY", carried.axis != nullptr ? 2 : carried.way != nullptr ? 1 : 0}};
  kernel.constants = {{"u_least_root", glm::radians(limits.least_root_deg)},
                      {"u_least_tip", glm::radians(limits.least_tip_deg)},
                      {"u_most_root", glm::radians(limits.most_root_deg)},
                      {"u_most_tip", glm::radians(limits.most_tip_deg)}};
  kernel.meets_air = false;
  kernel.meets_colliders = false;
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

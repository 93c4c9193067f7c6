#include "server/sim/follicle_limit.h"

#include "common/kernels/strand_passes.h"

namespace strandcast {

Result<FollicleLimit> FollicleLimit::make(Executor& executor, const SceneFeatures& features,
                                          const StrandLayout& layout, const CarriedPlanes& carried) {
  const KernelDesc kernel = follicle_limit_kernel(carried.memory());
  FollicleLimit limit;
  ASSIGN_OR_RETURN(limit.program_, executor.make_program(kernel, features, layout));
  return limit;
}

bool FollicleLimit::holds(const StepInput& input, const StrandLayout& layout) {
  return has_follicle_limit(input) && layout.has_free_tips() &&
         layout.pinned_root_count < layout.vertex_count;
}

void FollicleLimit::run(const StepBlock& step, size_t collider_count, BoundPlanes strands,
                        const CarriedPlanes& carried) {
  plane_of(strands, PlaneRole::Displacement) = carried.way;
  plane_of(strands, PlaneRole::RodAxis) = carried.axis;
  program_->run(step, collider_count, strands);
}

}  // namespace strandcast

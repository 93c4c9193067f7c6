#include "server/sim/follicle_limit.h"

#include <epoxy/gl.h>

#include "shaders/shared/bindings.h"
#include "shaders/shared/limits.h"

namespace strandcast {
namespace {

uint32_t group_count(const StrandLayout& layout) {
  return (layout.strand_count + shader::kStrandLocalSize - 1) / shader::kStrandLocalSize;
}

}  // namespace

Result<FollicleLimit> FollicleLimit::make(const gl::ShaderLibrary& shaders, const SceneFeatures& features,
                                          const StrandLayout& layout, const CarriedPlanes& carried) {
  RETURN_IF_ERROR(check_group_count(layout, group_count(layout)));
  const int memory = carried.axis != nullptr ? 2 : carried.way != nullptr ? 1 : 0;
  KernelDesc kernel{"sim/follicle_limit.comp", {{"MEMORY", memory}}, {}};
  kernel.meets_air = false;
  FollicleLimit limit;
  ASSIGN_OR_RETURN(limit.programs_, StrandPrograms::make(shaders, features, kernel));
  return limit;
}

bool FollicleLimit::holds(const StepInput& input, const StrandLayout& layout) {
  return has_follicle_limit(input) && layout.pinned_tail_count == 0 &&
         layout.pinned_root_count < layout.vertex_count;
}

void FollicleLimit::run(const StepInput& input, const StrandLayout& layout,
                        const CarriedPlanes& carried) const {
  if (carried.way != nullptr) {
    carried.way->bind_storage(shader::kBindingDisplacement);
    carried.way->bind_view(shader::kUnitDisplacement);
  }
  if (carried.axis != nullptr) {
    carried.axis->bind_storage(shader::kBindingRodAxis);
    carried.axis->bind_view(shader::kUnitRodAxis);
  }
  programs_.fitting(input.colliders.size()).use();
  glDispatchCompute(group_count(layout), 1, 1);
}

}  // namespace strandcast

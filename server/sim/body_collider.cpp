#include "server/sim/body_collider.h"

#include "common/kernels/strand_passes.h"

namespace strandcast {

Result<BodyCollider> BodyCollider::make(Executor& executor, const SceneFeatures& features,
                                        const StrandState& strands, const CarriedPlanes& carried) {
  const KernelDesc kernel = body_collider_kernel(carried.memory());
  BodyCollider collider;
  ASSIGN_OR_RETURN(collider.program_, executor.make_program(kernel, features, strands.layout()));
  ASSIGN_OR_RETURN(collider.table_, executor.make_table("the body", static_cast<uint32_t>(kBodyTableSize)));
  std::vector<glm::vec4> places;
  BoundPlanes planes = strands.planes();
  plane_of(planes, PlaneRole::Position)->read(places);
  const glm::dquat head_from_world = glm::conjugate(strands.head().world_from_head_rotation);
  for (glm::vec4& place : places) place = glm::vec4(glm::vec3(head_from_world * glm::dvec3(place)), 0.0f);
  collider.before_ = executor.make_plane("place before the body", strands.layout().strand_count, places);
  return collider;
}

void BodyCollider::run(const StepBlock& step, const StepInput& input, BoundPlanes strands,
                       const CarriedPlanes& carried) {
  table_->write(body_table(input.body, limited_substep_s(input), is_new_ || input.body.is_new));
  is_new_ = false;
  plane_of(strands, PlaneRole::Displacement) = carried.way;
  plane_of(strands, PlaneRole::RodAxis) = carried.axis;
  plane_of(strands, PlaneRole::PlaceBefore) = before_.get();
  BoundTables tables{};
  table_of(tables, TableRole::Body) = table_.get();
  program_->run(step, 0, strands, tables);
}

uint64_t BodyCollider::size_bytes() const {
  return program_->size_bytes() + table_->size_bytes() + before_->size_bytes();
}

}  // namespace strandcast

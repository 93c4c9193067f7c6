#include "server/sim/field_collider.h"

#include "common/kernels/strand_passes.h"

namespace strandcast {
Result<FieldCollider> FieldCollider::make(Executor& executor, const SceneFeatures& features,
                                          const StrandState& strands, const CarriedPlanes& carried,
                                          const DistanceField& field) {
  FieldCollider collider;
  ASSIGN_OR_RETURN(collider.program_,
                   executor.make_program(field_collider_kernel(field.grid(), carried.memory()), features,
                                         strands.layout()));
  ASSIGN_OR_RETURN(collider.table_, executor.make_table("the head's distance field",
                                                        static_cast<uint32_t>(field.quad.size())));
  collider.table_->write(field.quad);
  std::vector<glm::vec4> places;
  BoundPlanes planes = strands.planes();
  plane_of(planes, PlaneRole::Position)->read(places);
  const glm::dquat head_from_world = glm::conjugate(strands.head().world_from_head_rotation);
  for (glm::vec4& place : places) place = glm::vec4(glm::vec3(head_from_world * glm::dvec3(place)), 0.0f);
  collider.before_ = executor.make_plane("place before", strands.layout().strand_count, places);
  return collider;
}

void FieldCollider::run(const StepBlock& step, BoundPlanes strands, const CarriedPlanes& carried) {
  plane_of(strands, PlaneRole::Displacement) = carried.way;
  plane_of(strands, PlaneRole::RodAxis) = carried.axis;
  plane_of(strands, PlaneRole::PlaceBefore) = before_.get();
  BoundTables tables{};
  table_of(tables, TableRole::Field) = table_.get();
  program_->run(step, 0, strands, tables);
}

uint64_t FieldCollider::size_bytes() const {
  return program_->size_bytes() + table_->size_bytes() + before_->size_bytes();
}

}  // namespace strandcast

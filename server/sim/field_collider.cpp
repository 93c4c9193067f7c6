#include "server/sim/field_collider.h"

#include <algorithm>

namespace strandcast {
namespace {

KernelDesc kernel_for(const DistanceField& field, const CarriedPlanes& carried) {
  KernelDesc kernel;
  kernel.shader_path = "sim/field_collider.comp";
  kernel.variant = {{"MEMORY", carried.axis != nullptr ? 2 : carried.way != nullptr ? 1 : 0}};
  kernel.meets_air = kernel.meets_colliders = false;
  const glm::dvec3 origin(field.origin_m);
  const glm::dvec3 last = glm::dvec3(field.node_count) - 2.0;
  kernel.constants = {{"u_origin_x", origin.x},
                      {"u_origin_y", origin.y},
                      {"u_origin_z", origin.z},
                      {"u_cells_per_m", 1.0 / static_cast<double>(field.cell_m)},
                      {"u_last_x", last.x},
                      {"u_last_y", last.y},
                      {"u_last_z", last.z},
                      {"u_row_nodes", static_cast<double>(field.node_count.x)},
                      {"u_slice_nodes", static_cast<double>(field.node_count.x * field.node_count.y)}};
  return kernel;
}

}  // namespace

Result<FieldCollider> FieldCollider::make(Executor& executor, const SceneFeatures& features,
                                          const StrandState& strands, const CarriedPlanes& carried,
                                          const DistanceField& field) {
  FieldCollider collider;
  ASSIGN_OR_RETURN(collider.program_,
                   executor.make_program(kernel_for(field, carried), features, strands.layout()));
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

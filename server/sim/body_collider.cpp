#include "server/sim/body_collider.h"

#include <algorithm>
#include <cmath>

#include "shaders/shared/limits.h"

namespace strandcast {
namespace {

static_assert(shader::kMaxBodyCapsules == kMaxBodyCapsules && shader::kMaxBodyPlanes == kMaxBodyPlanes);
constexpr size_t kHeaderSize = 2, kCapsuleSize = 4, kPlaneSize = 2;
constexpr size_t kTableSize = kHeaderSize + kCapsuleSize * kMaxBodyCapsules + kPlaneSize * kMaxBodyPlanes;

/// Where a capsule is and was.
struct Placed {
  glm::dvec3 from_m, to_m, from_way_m, to_way_m;
  double from_radius_m, to_radius_m;
};

Placed place(const BodyCapsule& capsule) {
  const auto bounded = [](const glm::dvec3& point_m) { return limited(point_m, kMaxColliderM); };
  Placed placed{bounded(capsule.from_m),
                bounded(capsule.to_m),
                bounded(capsule.from_m) - bounded(capsule.from_before_m),
                bounded(capsule.to_m) - bounded(capsule.to_before_m),
                limited(capsule.from_radius_m, kMaxColliderM),
                limited(capsule.to_radius_m, kMaxColliderM)};
  // One ball inside of the other is the other.
  if (glm::distance(placed.from_m, placed.to_m) > std::abs(placed.from_radius_m - placed.to_radius_m))
    return placed;
  if (placed.to_radius_m > placed.from_radius_m) {
    placed.from_m = placed.to_m;
    placed.from_way_m = placed.to_way_m;
    placed.from_radius_m = placed.to_radius_m;
  }
  placed.to_m = placed.from_m;
  placed.to_way_m = placed.from_way_m;
  placed.to_radius_m = placed.from_radius_m;
  return placed;
}

void add_capsule(const Placed& capsule, glm::vec4* to) {
  const glm::dvec3 axis_m = capsule.to_m - capsule.from_m;
  const double length_m = glm::length(axis_m);
  const double gain_m = capsule.to_radius_m - capsule.from_radius_m;
  // Normals of a cone lean along its axis: by slope / sqrt(1 - slope^2) of the way from the axis.
  const double slope = length_m > 0.0 ? gain_m / length_m : 0.0;
  const double lean = length_m > 0.0 ? slope / std::sqrt(1.0 - slope * slope) / length_m : 0.0;
  to[0] = glm::vec4(glm::vec3(capsule.from_m), static_cast<float>(capsule.from_radius_m));
  to[1] = glm::vec4(glm::vec3(axis_m), static_cast<float>(gain_m));
  to[2] = glm::vec4(glm::vec3(capsule.from_way_m), static_cast<float>(lean));
  to[3] = glm::vec4(glm::vec3(capsule.to_way_m - capsule.from_way_m),
                    static_cast<float>(length_m > 0.0 ? 1.0 / (length_m * length_m) : 0.0));
}

}  // namespace

std::vector<glm::vec4> body_table(const BodyInput& body, double h_s, bool is_new) {
  std::vector<glm::vec4> table(kTableSize, glm::vec4(0.0f));
  const size_t capsule_count = std::min(body.capsules.size(), kMaxBodyCapsules);
  double longest_way_m = 0.0;
  size_t placed_count = 0;
  for (size_t i = 0; i < capsule_count; ++i) {
    const Placed capsule = place(body.capsules[i]);
    if (!(capsule.from_radius_m > 0.0) || !(capsule.to_radius_m > 0.0)) continue;
    longest_way_m = std::max({longest_way_m, glm::length(capsule.from_way_m), glm::length(capsule.to_way_m)});
    add_capsule(capsule, &table[kHeaderSize + kCapsuleSize * placed_count++]);
  }
  const size_t plane_count = std::min(body.planes.size(), kMaxBodyPlanes);
  for (size_t i = 0; i < plane_count; ++i) {
    const BodyPlane& plane = body.planes[i];
    glm::vec4* to = &table[kHeaderSize + kCapsuleSize * kMaxBodyCapsules + kPlaneSize * i];
    to[0] = glm::vec4(glm::vec3(plane.normal),
                      static_cast<float>(glm::dot(plane.normal, limited(plane.point_m, kMaxColliderM))));
    to[1] = glm::vec4(glm::vec3(limited(plane.shift_m, kMaxColliderM)), 1.0f);
  }
  // A push of more than the depth in one substep would throw strands.
  const double gain_per_s = std::min(std::max(body.force_per_s2, 0.0), 1.0 / (h_s * h_s)) * h_s;
  table[0] = {static_cast<float>(std::max(body.friction, 0.0)),
              static_cast<float>(std::max(body.tip_clearance_m - kBodyClearanceM, 0.0)),
              static_cast<float>(gain_per_s), is_new ? 1.0f : 0.0f};
  table[1] = {static_cast<float>(body.response), static_cast<float>(longest_way_m), 0.0f, 0.0f};
  return table;
}

Result<BodyCollider> BodyCollider::make(Executor& executor, const SceneFeatures& features,
                                        const StrandState& strands, const CarriedPlanes& carried) {
  KernelDesc kernel;
  kernel.shader_path = "sim/body_collider.comp";
  kernel.variant = {{"MEMORY", carried.axis != nullptr ? 2 : carried.way != nullptr ? 1 : 0}};
  kernel.meets_air = kernel.meets_colliders = false;
  BodyCollider collider;
  ASSIGN_OR_RETURN(collider.program_, executor.make_program(kernel, features, strands.layout()));
  ASSIGN_OR_RETURN(collider.table_, executor.make_table("the body", static_cast<uint32_t>(kTableSize)));
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

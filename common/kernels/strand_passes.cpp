#include "common/kernels/strand_passes.h"

#include <algorithm>
#include <cmath>

#include "common/kernels/step_input.h"
#include "shaders/shared/limits.h"

namespace strandcast {
namespace {

static_assert(shader::kMaxBodyCapsules == kMaxBodyCapsules && shader::kMaxBodyPlanes == kMaxBodyPlanes);
constexpr size_t kHeaderSize = 2, kCapsuleSize = 4, kPlaneSize = 2;

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

KernelDesc pass_kernel(const char* shader_path) {
  KernelDesc kernel;
  kernel.shader_path = shader_path;
  return kernel;
}

}  // namespace

const size_t kBodyTableSize = kHeaderSize + kCapsuleSize * kMaxBodyCapsules + kPlaneSize * kMaxBodyPlanes;

KernelDesc follicle_limit_kernel(int memory) {
  KernelDesc kernel = pass_kernel("sim/follicle_limit.comp");
  kernel.variant = {{"MEMORY", memory}};
  kernel.meets_air = false;
  return kernel;
}

KernelDesc bend_limit_kernel(const BendAngles& angles, int memory) {
  KernelDesc kernel = pass_kernel("sim/bend_limit.comp");
  kernel.variant = {{"MEMORY", memory}};
  kernel.constants = {{"u_least_root", angles.least_root_rad},
                      {"u_least_tip", angles.least_tip_rad},
                      {"u_most_root", angles.most_root_rad},
                      {"u_most_tip", angles.most_tip_rad}};
  kernel.meets_air = kernel.meets_colliders = false;
  return kernel;
}

KernelDesc oriented_drag_kernel(double along_share, bool has_way) {
  KernelDesc kernel = pass_kernel("sim/oriented_drag.comp");
  kernel.variant = {{"HAS_WAY", has_way ? 1 : 0}};
  kernel.constants = {{"u_given_back", 1.0 - along_share}};
  kernel.meets_colliders = false;
  return kernel;
}

KernelDesc field_collider_kernel(const FieldGrid& grid, int memory) {
  KernelDesc kernel = pass_kernel("sim/field_collider.comp");
  kernel.variant = {{"MEMORY", memory}};
  kernel.meets_air = kernel.meets_colliders = false;
  const glm::dvec3 origin(grid.origin_m);
  const glm::dvec3 last = glm::dvec3(grid.node_count) - 2.0;
  kernel.constants = {{"u_origin_x", origin.x},
                      {"u_origin_y", origin.y},
                      {"u_origin_z", origin.z},
                      {"u_cells_per_m", 1.0 / static_cast<double>(grid.cell_m)},
                      {"u_last_x", last.x},
                      {"u_last_y", last.y},
                      {"u_last_z", last.z},
                      {"u_row_nodes", static_cast<double>(grid.node_count.x)},
                      {"u_slice_nodes", static_cast<double>(grid.node_count.x * grid.node_count.y)}};
  return kernel;
}

KernelDesc body_collider_kernel(int memory) {
  KernelDesc kernel = pass_kernel("sim/body_collider.comp");
  kernel.variant = {{"MEMORY", memory}};
  kernel.meets_air = kernel.meets_colliders = false;
  return kernel;
}

KernelDesc put_back_kernel(Tips of) {
  KernelDesc kernel = pass_kernel("sim/put_back.comp");
  kernel.variant = {{"HAS_PINNED_TAIL", of == Tips::Pinned ? 1 : 0}};
  kernel.meets_air = kernel.meets_colliders = false;
  return kernel;
}

std::vector<glm::vec4> body_table(const BodyInput& body, double h_s, bool is_new) {
  std::vector<glm::vec4> table(kBodyTableSize, glm::vec4(0.0f));
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

}  // namespace strandcast

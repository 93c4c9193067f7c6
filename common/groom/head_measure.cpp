#include "common/groom/head_measure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "common/base/quantile.h"
#include "common/base/units.h"
#include "common/groom/head_fit.h"
#include "common/groom/head_spheres.h"
#include "common/math/point_tree.h"

namespace strandcast {
namespace {

constexpr double kHalf = 0.5, kMost = 0.95;

/// Distance from the plane of the nearest vertex, or from the vertex where it lies at an edge of the mesh.
std::vector<double> root_distances(const Mesh& head, const Groom& groom) {
  std::vector<double> distances;
  if (head.position_m.empty()) return distances;
  const PointTree tree(head.position_m);
  for (const glm::vec3& root : roots_of(groom)) {
    const uint32_t nearest = tree.nearest(root, 1).front().index;
    const glm::dvec3 offset = glm::dvec3(root) - glm::dvec3(head.position_m[nearest]);
    distances.push_back(std::abs(glm::dot(offset, glm::dvec3(head.normal[nearest]))));
  }
  return distances;
}

/// Distances of the middles of triangles under hair: of half and of most of their area.
std::pair<double, double> sphere_distances(const Mesh& head, const std::vector<FittedSphere>& spheres,
                                           const Groom& groom) {
  constexpr size_t kHairPoints = 50'000;  // more of them say nothing new
  std::vector<glm::vec3> hair_m;
  const size_t step = groom.rest_position_m.size() / kHairPoints + 1;
  for (size_t i = 0; i < groom.rest_position_m.size(); i += step) hair_m.push_back(groom.rest_position_m[i]);
  const PointTree hair(hair_m);
  std::vector<std::pair<double, double>> parts;  // distance, area
  double total = 0.0;
  for (const glm::uvec3& corner : head.triangle) {
    const glm::dvec3 a = head.position_m[corner.x], b = head.position_m[corner.y],
                     c = head.position_m[corner.z];
    const glm::dvec3 middle = (a + b + c) / 3.0;
    if (hair.nearest(glm::vec3(middle), 1).front().distance_squared > kUnderHairM * kUnderHairM) continue;
    const double area = 0.5 * glm::length(glm::cross(b - a, c - a));
    parts.emplace_back(std::abs(distance_to_spheres_m(spheres, middle)), area);
    total += area;
  }
  std::sort(parts.begin(), parts.end());
  double half = 0.0, most = 0.0, below = 0.0;
  for (const auto& [distance, area] : parts) {
    if (below <= kHalf * total) half = distance;
    if (below <= kMost * total) most = distance;
    below += area;
  }
  return {half, most};
}

}  // namespace

HeadMeasure measure_head(const Mesh& head, const std::vector<FittedSphere>& spheres, const Groom& groom) {
  HeadMeasure measure;
  const std::vector<double> roots = root_distances(head, groom);
  measure.root_median_m = quantile(roots, kHalf);
  measure.root_most_m = quantile(roots, kMost);
  if (!spheres.empty())
    std::tie(measure.sphere_median_m, measure.sphere_most_m) = sphere_distances(head, spheres, groom);
  for (const glm::vec3& point : groom.rest_position_m)
    measure.deepest_vertex_m = std::max(measure.deepest_vertex_m, -distance_to_spheres_m(spheres, point));
  return measure;
}

std::string to_sentence(const HeadMeasure& measure, size_t sphere_count) {
  return fmt::format(
      "head: half of the roots lie within {:.1f} mm of the drawn skin, 95 % within {:.1f} mm; {} spheres "
      "collide, half "
      "of the skin under hair is within {:.1f} mm of them, 95 % within {:.1f} mm; the hair as loaded is at "
      "most {:.1f} "
      "mm deep in "
      "them",
      measure.root_median_m * kMmPerM, measure.root_most_m * kMmPerM, sphere_count,
      measure.sphere_median_m * kMmPerM, measure.sphere_most_m * kMmPerM, measure.deepest_vertex_m * kMmPerM);
}

namespace {

template <class Distance>
HairInside inside_where(const Groom& groom, Distance distance_m_at) {
  HairInside inside;
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand) {
    const size_t before = inside.vertex_count;
    for (uint32_t i = groom.offset[strand]; i < groom.offset[strand + 1]; ++i) {
      if (groom.pinned[i] != 0) continue;
      const double distance_m = distance_m_at(groom.rest_position_m[i]);
      if (distance_m >= 0.0) continue;
      ++inside.vertex_count;
      inside.deepest_m = std::max(inside.deepest_m, -distance_m);
    }
    if (inside.vertex_count > before) ++inside.strand_count;
  }
  return inside;
}

/// Distance from a capsule at the point's foot on its axis; the side of a cone may be a little nearer.
double distance_about(const BodyCapsule& capsule, const glm::dvec3& point_m) {
  const glm::dvec3 axis = capsule.to_m - capsule.from_m;
  const double squared = glm::dot(axis, axis);
  const double share =
      squared > 0.0 ? std::clamp(glm::dot(point_m - capsule.from_m, axis) / squared, 0.0, 1.0) : 0.0;
  return glm::distance(point_m, capsule.from_m + share * axis) -
         glm::mix(capsule.from_radius_m, capsule.to_radius_m, share);
}

}  // namespace

HairInside measure_inside(const DistanceField& field, const Groom& groom) {
  return inside_where(groom, [&](const glm::vec3& point) { return field.sample(point).distance_m; });
}

HairInside measure_inside(const BodyInput& body, const Groom& groom) {
  return inside_where(groom, [&](const glm::dvec3& point_m) {
    double nearest_m = std::numeric_limits<double>::max();
    for (const BodyCapsule& capsule : body.capsules)
      nearest_m = std::min(nearest_m, distance_about(capsule, point_m));
    for (const BodyPlane& plane : body.planes)
      nearest_m = std::min(nearest_m, glm::dot(plane.normal, point_m - plane.point_m));
    return nearest_m;
  });
}

std::string to_sentence(const HairInside& inside, size_t capsule_count) {
  if (inside.vertex_count == 0)
    return fmt::format("the body has {} capsules; no free vertex of the hair as loaded is inside of it",
                       capsule_count);
  return fmt::format(
      "the body has {} capsules; {} free vertices of {} strands as loaded are inside of it, at most {:.1f} "
      "mm deep, "
      "and stay until they get out",
      capsule_count, inside.vertex_count, inside.strand_count, inside.deepest_m * kMmPerM);
}

std::string to_sentence(const HairInside& inside, const DistanceField& field) {
  const glm::uvec3& nodes = field.node_count;
  const std::string size =
      fmt::format("the head collides as a distance field of {} x {} x {} nodes, {:.1f} mm apart", nodes.x,
                  nodes.y, nodes.z, static_cast<double>(field.cell_m) * kMmPerM);
  if (inside.vertex_count == 0) return size + "; no free vertex of the hair as loaded is inside of it";
  return fmt::format(
      "{}; the groom has {} vertices of {} strands up to {:.1f} mm below it, and they keep that depth: "
      "nothing "
      "need be done",
      size, inside.vertex_count, inside.strand_count, inside.deepest_m * kMmPerM);
}

}  // namespace strandcast

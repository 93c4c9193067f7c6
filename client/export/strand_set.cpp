#include "client/export/strand_set.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace strandcast {
namespace {

/// What the simulated strands are: as many vertices each, thinner towards the tip.
ExportShape simulated_shape(const ExportScene& scene) {
  const uint32_t strands = scene.asset->strand_count;
  const uint32_t vertices = scene.asset->vertex_count;
  ExportShape shape;
  for (uint32_t strand = 0; strand <= strands; ++strand) shape.first_point.push_back(strand * vertices);
  for (uint32_t strand = 0; strand < strands; ++strand)
    for (uint32_t vertex = 0; vertex < vertices; ++vertex) {
      const float along = static_cast<float>(vertex) / static_cast<float>(vertices - 1);
      shape.width_m.push_back(2.0f * scene.strand_radius_m * (1.0f + (scene.tip_scale - 1.0f) * along));
    }
  return shape;
}

template <class Point>
double length_of(std::span<const Point> points) {
  double length = 0.0;
  for (size_t i = 1; i < points.size(); ++i)
    length += glm::distance(glm::dvec3(points[i - 1]), glm::dvec3(points[i]));
  return length;
}

}  // namespace

StrandSet::StrandSet(const ExportScene& scene, const ExportOptions& options, const PosedStrands& first)
    : scene_(scene),
      options_(options),
      first_pose_(first.world_from_head),
      shape_(scene.drawing ? scene.drawing->shape() : simulated_shape(scene)) {
  const std::vector<glm::vec3> rest_m = in_head(scene.asset->rest_position_m);
  const std::vector<glm::vec3> first_m = in_head(first.position_m);
  const auto unit_m = static_cast<float>(metres_of(options.unit));
  for (uint32_t strand = 0; strand + 1 < shape_.first_point.size(); ++strand) {
    const uint32_t begin = shape_.first_point[strand];
    const uint32_t count = shape_.first_point[strand + 1] - begin;
    const auto length_m = [&](std::span<const glm::vec3> points) {
      return length_of(points.subspan(begin, count));
    };
    if (std::min(length_m(rest_m), length_m(first_m)) < kLeastExportedLengthM) {
      ++left_out_count_;
      continue;
    }
    strand_.push_back(strand);
    vertex_counts_.push_back(count);
    vertex_count_ = std::max(vertex_count_, count);
    for (uint32_t i = begin; i < begin + count; ++i) width_.push_back(shape_.width_m[i] / unit_m);
  }
}

/// Points of all strands, strand after strand.
std::vector<glm::vec3> StrandSet::in_head(const std::vector<glm::vec3>& position_m) const {
  if (scene_.drawing) return scene_.drawing->points(position_m);
  std::vector<glm::vec3> points;
  points.reserve(position_m.size());
  const size_t strands = scene_.asset->strand_count;
  for (size_t strand = 0; strand < strands; ++strand)
    for (size_t i = strand; i < position_m.size(); i += strands) points.push_back(position_m[i]);
  return points;
}

glm::dvec3 StrandSet::in_file(const glm::vec3& point_in_head, const Pose& world_from_head) const {
  const glm::dvec3 placed = options_.space == ExportSpace::World ? world_from_head * glm::dvec3(point_in_head)
                                                                 : glm::dvec3(point_in_head);
  const glm::dvec3 p = placed / metres_of(options_.unit);
  return options_.up == ExportUp::Z ? glm::dvec3(p.x, -p.z, p.y) : p;
}

std::vector<glm::dvec3> StrandSet::points(const PosedStrands& strands) const {
  const std::vector<glm::vec3> all = in_head(strands.position_m);
  std::vector<glm::dvec3> points;
  points.reserve(width_.size());
  for (const uint32_t strand : strand_)
    for (uint32_t i = shape_.first_point[strand]; i < shape_.first_point[strand + 1]; ++i)
      points.push_back(in_file(all[i], strands.world_from_head));
  return points;
}

std::vector<glm::vec2> StrandSet::root_uv() const {
  constexpr auto kPi = std::numbers::pi_v<float>;
  const std::vector<glm::vec3> rest_m = in_head(scene_.asset->rest_position_m);
  const auto root = [&](uint32_t strand) { return rest_m[shape_.first_point[strand]]; };
  glm::dvec3 middle(0.0);
  for (const uint32_t strand : strand_) middle += glm::dvec3(root(strand));
  middle /= std::max(1.0, static_cast<double>(strand_.size()));
  std::vector<glm::vec2> uv;
  uv.reserve(strand_.size());
  for (const uint32_t strand : strand_) {
    const glm::vec3 out = root(strand) - glm::vec3(middle);
    const float length = glm::length(out);
    const float up = length > 0.0f ? std::clamp(out.y / length, -1.0f, 1.0f) : 1.0f;
    uv.emplace_back(0.5f + std::atan2(out.x, out.z) / (2.0f * kPi), 0.5f + std::asin(up) / kPi);
  }
  return uv;
}

uint32_t StrandSet::collapsed_count(std::span<const glm::dvec3> points) const {
  uint32_t collapsed = 0;
  size_t begin = 0;
  for (const uint32_t count : vertex_counts_) {
    if (length_of(points.subspan(begin, count)) * metres_of(options_.unit) < kLeastExportedLengthM)
      ++collapsed;
    begin += count;
  }
  return collapsed;
}

std::vector<glm::dvec3> StrandSet::head_points(const Pose& world_from_head) const {
  std::vector<glm::dvec3> points;
  if (options_.has_head)
    for (const glm::vec3& point : scene_.asset->head.position_m)
      points.push_back(in_file(point, world_from_head));
  return points;
}

std::span<const glm::uvec3> StrandSet::head_triangles() const {
  if (!options_.has_head) return {};
  return scene_.asset->head.triangle;
}

}  // namespace strandcast

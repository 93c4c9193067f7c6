#include "client/export/strand_set.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace strandcast {
namespace {

double length_m(const PosedStrands& strands, size_t strand_count, size_t strand) {
  double length = 0.0;
  for (size_t i = strand; i + strand_count < strands.position_m.size(); i += strand_count)
    length +=
        glm::distance(glm::dvec3(strands.position_m[i]), glm::dvec3(strands.position_m[i + strand_count]));
  return length;
}

}  // namespace

StrandSet::StrandSet(const ExportScene& scene, const ExportOptions& options, const PosedStrands& first)
    : all_strand_count_(scene.asset->strand_count),
      vertex_count_(scene.asset->vertex_count),
      options_(options),
      rest_{first.world_from_head, scene.asset->rest_position_m} {
  for (uint32_t strand = 0; strand < all_strand_count_; ++strand) {
    const double shortest_m =
        std::min(length_m(rest_, all_strand_count_, strand), length_m(first, all_strand_count_, strand));
    if (shortest_m < kLeastExportedLengthM)
      ++left_out_count_;
    else
      strand_.push_back(strand);
  }
  const auto unit_m = static_cast<float>(metres_of(options.unit));
  for (uint32_t vertex = 0; vertex < vertex_count_; ++vertex) {
    const float along = static_cast<float>(vertex) / static_cast<float>(vertex_count_ - 1);
    const float radius_m = scene.strand_radius_m * (1.0f + (scene.tip_scale - 1.0f) * along);
    width_.push_back(2.0f * radius_m / unit_m);
  }
}

std::vector<glm::dvec3> StrandSet::points(const PosedStrands& strands) const {
  std::vector<glm::dvec3> points;
  points.reserve(strand_.size() * vertex_count_);
  const double units_per_m = 1.0 / metres_of(options_.unit);
  const Pose& pose = strands.world_from_head;
  const bool is_world = options_.space == ExportSpace::World;
  const glm::dmat3 turn = is_world ? glm::mat3_cast(pose.rotation) : glm::dmat3(1.0);
  const glm::dvec3 shift = is_world ? pose.position_m : glm::dvec3(0.0);
  for (const uint32_t strand : strand_) {
    for (uint32_t vertex = 0; vertex < vertex_count_; ++vertex) {
      const glm::dvec3 in_head(strands.position_m[size_t{vertex} * all_strand_count_ + strand]);
      const glm::dvec3 p = (turn * in_head + shift) * units_per_m;
      points.push_back(options_.up == ExportUp::Z ? glm::dvec3(p.x, -p.z, p.y) : p);
    }
  }
  return points;
}

std::vector<glm::vec2> StrandSet::root_uv() const {
  constexpr auto kPi = std::numbers::pi_v<float>;
  glm::dvec3 middle(0.0);
  for (const uint32_t strand : strand_) middle += glm::dvec3(rest_.position_m[strand]);
  middle /= std::max(1.0, static_cast<double>(strand_.size()));
  std::vector<glm::vec2> uv;
  uv.reserve(strand_.size());
  for (const uint32_t strand : strand_) {
    const glm::vec3 out = rest_.position_m[strand] - glm::vec3(middle);
    const float length = glm::length(out);
    const float up = length > 0.0f ? std::clamp(out.y / length, -1.0f, 1.0f) : 1.0f;
    uv.emplace_back(0.5f + std::atan2(out.x, out.z) / (2.0f * kPi), 0.5f + std::asin(up) / kPi);
  }
  return uv;
}

uint32_t StrandSet::collapsed_count(const PosedStrands& strands) const {
  return static_cast<uint32_t>(std::count_if(strand_.begin(), strand_.end(), [&](uint32_t strand) {
    return length_m(strands, all_strand_count_, strand) < kLeastExportedLengthM;
  }));
}

}  // namespace strandcast

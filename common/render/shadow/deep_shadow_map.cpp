#include "common/render/shadow/deep_shadow_map.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace strandcast {
namespace {

// As line_coverage() of shaders/lib/coverage.glsl.
double line_coverage(double width, double distance) {
  return std::clamp(0.5 * (width + 1.0) - std::abs(distance), 0.0, std::min(width, 1.0));
}

}  // namespace

DeepShadowMap::DeepShadowMap(const LightFrame& frame, double strand_opacity)
    : frame_(frame), strand_opacity_(strand_opacity) {}

void DeepShadowMap::add(std::span<const ExpandedVertex> vertices, double width_m, double tip_scale) {
  for (size_t i = 0; i + 1 < vertices.size(); i += 2)
    add_segment(vertices[i], vertices[i + 1], width_m, tip_scale);
}

// Every texel whose middle lies beside the segment takes what of it the segment covers.
void DeepShadowMap::add_segment(const ExpandedVertex& from, const ExpandedVertex& to, double width_m,
                                double tip_scale) {
  const glm::dvec3 a(frame_.in_map(from.position_m));
  const glm::dvec3 b(frame_.in_map(to.position_m));
  const glm::dvec2 way = glm::dvec2(b) - glm::dvec2(a);
  const double length2 = glm::dot(way, way);
  if (!(length2 > 0.0) || !std::isfinite(length2) || !std::isfinite(a.z + b.z)) return;
  const auto width_at = [&](double along) {
    return width_m * (1.0 + (tip_scale - 1.0) * along * along) * frame_.texels_per_m;
  };
  const double widths[2] = {width_at(from.along), width_at(to.along)};
  const double reach = 0.5 * (std::max(widths[0], widths[1]) + 1.0);
  const auto inside = [&](double texel) {
    return static_cast<int>(std::clamp(std::floor(texel), 0.0, frame_.texels - 1.0));
  };
  const double length = std::sqrt(length2);
  for (int y = inside(std::min(a.y, b.y) - reach); y <= inside(std::max(a.y, b.y) + reach); ++y)
    for (int x = inside(std::min(a.x, b.x) - reach); x <= inside(std::max(a.x, b.x) + reach); ++x) {
      const glm::dvec2 away = glm::dvec2(x + 0.5, y + 0.5) - glm::dvec2(a);
      const double t = glm::dot(away, way) / length2;
      // A joint belongs to the segment that begins there.
      if (!(t >= 0.0 && t < 1.0)) continue;
      const double distance = (way.x * away.y - way.y * away.x) / length;
      const double covered = line_coverage(widths[0] + t * (widths[1] - widths[0]), distance);
      if (covered > 0.0)
        crossings_.push_back({a.z + t * (b.z - a.z), strand_opacity_ * covered,
                              static_cast<uint32_t>(y) * frame_.texels + static_cast<uint32_t>(x)});
    }
}

void DeepShadowMap::finish() {
  std::sort(crossings_.begin(), crossings_.end(), [](const Crossing& a, const Crossing& b) {
    return std::tie(a.texel, a.at_m, a.depth) < std::tie(b.texel, b.at_m, b.depth);
  });
  first_.assign(size_t{frame_.texels} * frame_.texels + 1, 0);
  for (const Crossing& crossing : crossings_) ++first_[crossing.texel + 1];
  for (size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  for (size_t i = 1; i < crossings_.size(); ++i)
    if (crossings_[i].texel == crossings_[i - 1].texel) crossings_[i].depth += crossings_[i - 1].depth;
}

std::span<const DeepShadowMap::Crossing> DeepShadowMap::ray(int x, int y) const {
  const int last = static_cast<int>(frame_.texels) - 1;
  const size_t texel = static_cast<size_t>(std::clamp(y, 0, last)) * frame_.texels +
                       static_cast<size_t>(std::clamp(x, 0, last));
  return std::span(crossings_).subspan(first_[texel], first_[texel + 1] - first_[texel]);
}

double DeepShadowMap::depth_at(int x, int y, double at_m) const {
  const auto crossings = ray(x, y);
  const auto behind = std::partition_point(crossings.begin(), crossings.end(),
                                           [&](const Crossing& crossing) { return crossing.at_m < at_m; });
  return behind == crossings.begin() ? 0.0 : std::prev(behind)->depth;
}

double DeepShadowMap::optical_depth(const glm::vec3& point_m) const {
  const glm::dvec3 at(frame_.in_map(point_m));
  if (!(std::abs(at.x) < 1e6 && std::abs(at.y) < 1e6)) return 0.0;
  const double low_x = std::floor(at.x - 0.5), low_y = std::floor(at.y - 0.5);
  const double part_x = at.x - 0.5 - low_x, part_y = at.y - 0.5 - low_y;
  const int x = static_cast<int>(low_x), y = static_cast<int>(low_y);
  const double below = (1.0 - part_x) * depth_at(x, y, at.z) + part_x * depth_at(x + 1, y, at.z);
  const double above = (1.0 - part_x) * depth_at(x, y + 1, at.z) + part_x * depth_at(x + 1, y + 1, at.z);
  return (1.0 - part_y) * below + part_y * above;
}

std::vector<ShadowStep> DeepShadowMap::steps(uint32_t x, uint32_t y, double tolerance) const {
  std::vector<ShadowStep> steps;
  double passing = 1.0;
  const auto crossings = ray(static_cast<int>(x), static_cast<int>(y));
  for (size_t i = 0; i < crossings.size(); ++i) {
    const double now = std::exp(-crossings[i].depth);
    if (passing - now < tolerance && i + 1 < crossings.size()) continue;
    steps.push_back({static_cast<float>(crossings[i].at_m), static_cast<float>(crossings[i].depth)});
    passing = now;
  }
  return steps;
}

}  // namespace strandcast

#include "common/render/rest_facts.h"

#include <algorithm>
#include <cmath>

#include "common/groom/bust_skin.h"
#include "common/render/passes/expand_pass.h"

namespace strandcast {
namespace {

constexpr uint32_t kMaxFollowers = 64;  // per triangle
// Cells of the light volume along the largest extent of the rest shape.
constexpr float kLightVolumeCells = 32.0f;
constexpr float kMinLightCellM = 1e-4f;
// With fewer roots a sphere fitted to them is no skull.
constexpr uint32_t kMinSkullRoots = 32;
// Nor is it one when more than this share of the head's vertices lies deep inside of it, in radii.
constexpr float kDeepInside = 0.75f;
constexpr float kMaxDeepShare = 0.15f;
// The skull that shadows is a little smaller than the sphere through the roots, so that it does not darken
// them.
constexpr float kSkullShrink = 0.93f;

/// How much strands bend between two vertices: the mean size of the second derivative of their curves
/// (shaders/lib/hermite.glsl) by the way from vertex to vertex, at its ends.
float mean_bend_m(const SceneAsset& asset) {
  constexpr uint32_t kStrandsSeen = 1024;
  const uint32_t last = asset.vertex_count - 1;
  const uint32_t every = asset.strand_count / kStrandsSeen + 1;
  double sum_m = 0.0;
  uint64_t count = 0;
  for (uint32_t strand = 0; strand < asset.strand_count; strand += every) {
    const auto vertex = [&](uint32_t v) {
      return asset.rest_position_m[size_t{v} * asset.strand_count + strand];
    };
    for (uint32_t gap = 0; gap < last; ++gap) {
      const glm::vec3 chord = vertex(gap + 1) - vertex(gap);
      const glm::vec3 m0 = gap == 0 ? chord : 0.5f * (vertex(gap + 1) - vertex(gap - 1));
      const glm::vec3 m1 = gap + 1 == last ? chord : 0.5f * (vertex(gap + 2) - vertex(gap));
      const double bend_m =
          glm::length(3.0f * chord - 2.0f * m0 - m1) + glm::length(m0 + 2.0f * m1 - 3.0f * chord);
      if (!std::isfinite(bend_m)) continue;
      sum_m += bend_m;
      ++count;
    }
  }
  return count > 0 ? static_cast<float>(sum_m / static_cast<double>(count)) : 0.0f;
}

// Whether a ball lies under the skin of a head instead of swallowing it, as a sphere through a mane that goes
// on down the neck would.
bool is_skull_of(const FittedSphere& ball, const Mesh& head) {
  const auto deep =
      std::count_if(head.position_m.begin(), head.position_m.end(), [&](const glm::vec3& point) {
        return glm::length(point - ball.center_m) < kDeepInside * ball.radius_m;
      });
  return static_cast<float>(deep) < kMaxDeepShare * static_cast<float>(head.position_m.size());
}

}  // namespace

RestFacts measure_rest(const SceneAsset& asset) {
  RestFacts facts;
  // Hair whose shape is no number is as large as any.
  constexpr float kUsualM = 0.3f;
  constexpr float kFarM = 1e4f;
  facts.extent_m = facts.mean_length_m = kUsualM;
  if (asset.strand_count == 0) return facts;
  double length_m = 0.0;
  glm::vec3 low = asset.rest_position_m.front();
  glm::vec3 high = low;
  for (size_t i = 0; i < asset.rest_position_m.size(); ++i) {
    const glm::vec3& point = asset.rest_position_m[i];
    low = glm::min(low, point);
    high = glm::max(high, point);
    if (i >= asset.strand_count)
      length_m += glm::length(point - asset.rest_position_m[i - asset.strand_count]);
  }
  facts.mean_length_m = static_cast<float>(length_m / asset.strand_count);
  facts.mean_bend_m = mean_bend_m(asset);
  facts.extent_m = std::max({high.x - low.x, high.y - low.y, high.z - low.z});
  if (!(facts.extent_m > 0.0f && facts.extent_m < kFarM)) facts.extent_m = kUsualM;
  if (!(facts.mean_length_m >= 0.0f && facts.mean_length_m < kFarM)) facts.mean_length_m = kUsualM;
  return facts;
}

LightVolumeDesc describe_light(const SceneAsset& asset, const LookDesc& look, const RestFacts& rest) {
  LightVolumeDesc desc;
  desc.strand_count = asset.strand_count;
  desc.vertex_count = asset.vertex_count;
  desc.cell_m = std::max(rest.extent_m / kLightVolumeCells, kMinLightCellM);
  desc.strand_width_m = 2.0f * look.strand_radius_m;
  if (asset.vertex_count > 1)
    desc.segment_m = rest.mean_length_m / static_cast<float>(asset.vertex_count - 1);
  if (asset.strand_count > 0)
    desc.strands_per_key = 1.0f + static_cast<float>(asset.triangle.size() * look.followers) /
                                      static_cast<float>(asset.strand_count);
  if (asset.strand_count >= kMinSkullRoots && !asset.head.triangle.empty()) {
    const std::vector<glm::vec3> roots_m(asset.rest_position_m.begin(),
                                         asset.rest_position_m.begin() + asset.strand_count);
    desc.skull = fit_sphere(roots_m);
    desc.has_skull = std::isfinite(desc.skull.radius_m) && is_skull_of(desc.skull, asset.head);
    desc.skull.radius_m *= kSkullShrink;
  }
  return desc;
}

LookDesc drawable(LookDesc look) {
  look.followers = std::min(look.followers, kMaxFollowers);
  look.segments = std::clamp(look.segments, 1u, kMaxSegmentsPerGap);
  return look;
}

LightLatticeDesc describe_lattice(const SceneAsset& asset, const RestFacts& rest,
                                  const LightVolumeDesc& light_volume, uint32_t cells) {
  LightLatticeDesc desc{rest.extent_m,      cells,   light_volume.has_skull,
                        light_volume.skull, nullptr, find_bust(asset.head)};
  std::optional<FittedSphere> skull;
  if (desc.has_skull) skull = FittedSphere{desc.skull.center_m, desc.skull.radius_m / kSkullShrink};
  desc.solid = std::make_shared<const HeadOccupancy>(make_head_occupancy(asset, skull));
  return desc;
}

}  // namespace strandcast

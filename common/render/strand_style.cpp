#include "common/render/strand_style.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace strandcast {
namespace {

// Hair of one triangle falls to different sides when, at this share of the length, the ways that its strands
// have gone from their roots point further apart than this.
constexpr float kPartedFrom = 0.5f;
constexpr float kPartedCosine = 0.5f;
// Strands of one triangle may move apart by this much of their length: a parting divides more.
constexpr float kMaxDivergence = 0.45f;
constexpr std::array<float, 4> kDivergenceAt = {0.25f, 0.5f, 0.75f, 1.0f};

glm::vec3 vertex_of(const SceneAsset& asset, uint32_t strand, uint32_t vertex) {
  return asset.rest_position_m[size_t{vertex} * asset.strand_count + strand];
}

glm::vec3 point_at(const SceneAsset& asset, uint32_t strand, float part) {
  const uint32_t last = asset.vertex_count - 1;
  const float at = part * static_cast<float>(last);
  const uint32_t vertex = std::min(static_cast<uint32_t>(at), last - 1);
  return glm::mix(vertex_of(asset, strand, vertex), vertex_of(asset, strand, vertex + 1),
                  at - static_cast<float>(vertex));
}

float length_m(const SceneAsset& asset, uint32_t strand) {
  float sum = 0.0f;
  for (uint32_t vertex = 1; vertex < asset.vertex_count; ++vertex)
    sum += glm::distance(vertex_of(asset, strand, vertex - 1), vertex_of(asset, strand, vertex));
  return sum;
}

/// True when the strands run beside each other: a follower between them stays between them.
bool runs_together(const SceneAsset& asset, uint32_t a, uint32_t b) {
  const float root_distance = glm::distance(vertex_of(asset, a, 0), vertex_of(asset, b, 0));
  const float reach = kMaxDivergence * std::max(length_m(asset, a), length_m(asset, b));
  return std::all_of(kDivergenceAt.begin(), kDivergenceAt.end(), [&](float part) {
    return glm::distance(point_at(asset, a, part), point_at(asset, b, part)) <= root_distance + part * reach;
  });
}

bool is_joined(const SceneAsset& asset, const RootTriangle& triangle) {
  return runs_together(asset, triangle.x, triangle.y) && runs_together(asset, triangle.y, triangle.z) &&
         runs_together(asset, triangle.z, triangle.x);
}

bool is_parted(const SceneAsset& asset, const RootTriangle& triangle) {
  const auto vertex =
      static_cast<size_t>(std::lround(kPartedFrom * static_cast<float>(asset.vertex_count - 1)));
  glm::vec3 way[3];
  for (int k = 0; k < 3; ++k) {
    way[k] =
        asset.rest_position_m[vertex * asset.strand_count + triangle[k]] - asset.rest_position_m[triangle[k]];
    const float length = glm::length(way[k]);
    if (!(length > 0.0f)) return false;
    way[k] /= length;
  }
  return std::min({glm::dot(way[0], way[1]), glm::dot(way[1], way[2]), glm::dot(way[2], way[0])}) <
         kPartedCosine;
}

}  // namespace

StyleNumbers style_numbers(const LookDesc& look, float mean_length_m) {
  const StrandStyleDesc& s = look.style;
  // Water draws strands together and lays the small waves.
  const float wet = look.shading.wetness;
  const float dry = 1.0f - wet;
  return {std::max(s.clump, wet),
          static_cast<float>(s.locks),
          s.spread * (0.3f + 0.7f * dry) * mean_length_m,
          s.wave_m,
          s.wave_count,
          s.frizz_m * dry,
          s.frizz_count,
          s.stray_share * dry,
          s.stray_spread,
          s.length_spread,
          s.short_share};
}

float style_room_m(const StyleNumbers& style) {
  return style.spread_m + style.wave_m + style.frizz_m;
}

std::vector<uint8_t> parted_triangles(const SceneAsset& asset) {
  std::vector<uint8_t> parted;
  parted.reserve(asset.triangle.size());
  for (const RootTriangle& triangle : asset.triangle)
    parted.push_back(is_parted(asset, triangle) || !is_joined(asset, triangle) ? 1 : 0);
  return parted;
}

std::vector<RootTriangle> joined_triangles(const SceneAsset& asset) {
  std::vector<RootTriangle> joined;
  for (const RootTriangle& triangle : asset.triangle)
    if (is_joined(asset, triangle)) joined.push_back(triangle);
  return joined;
}

}  // namespace strandcast

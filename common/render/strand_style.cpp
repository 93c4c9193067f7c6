#include "common/render/strand_style.h"

#include <algorithm>
#include <cmath>

namespace strandcast {
namespace {

// Hair of one triangle falls to different sides when, at this share of the length, the ways that its strands
// have gone from their roots point further apart than this.
constexpr float kPartedFrom = 0.5f;
constexpr float kPartedCosine = 0.5f;

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
  for (const RootTriangle& triangle : asset.triangle) parted.push_back(is_parted(asset, triangle) ? 1 : 0);
  return parted;
}

}  // namespace strandcast

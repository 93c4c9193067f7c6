// The look's style in the numbers of shaders/lib/strand_style.glsl, and where hair parts. Pure functions.
#pragma once

#include <cstdint>
#include <vector>

#include "common/scene/scene_desc.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

/// The members of StrandStyle, in their order: lengths in m, counts per strand, all else shares.
struct StyleNumbers {
  float clump = 0.0f, locks = 1.0f, spread_m = 0.0f, wave_m = 0.0f, wave_count = 0.0f, frizz_m = 0.0f,
        frizz_count = 0.0f, stray_share = 0.0f, stray_spread = 1.0f, length_spread = 0.0f, short_share = 0.0f;
};

/// `mean_length_m`: of a key strand at rest.
StyleNumbers style_numbers(const LookDesc& look, float mean_length_m);

/// What a drawn strand may lie beside its keys, m.
float style_room_m(const StyleNumbers& style);

/// Per root triangle: 1 where its hair falls to different sides at rest, else 0. Followers there hang on
/// their nearest key alone.
std::vector<uint8_t> parted_triangles(const SceneAsset& asset);
/// The triangles whose hair runs together at rest: for who lets followers hang between all three keys.
std::vector<RootTriangle> joined_triangles(const SceneAsset& asset);

}  // namespace strandcast

// Converts the look's style into the parameters of shaders/lib/strand_style.glsl, and finds where hair parts.
// Pure functions.
#pragma once

#include <cstdint>
#include <vector>

#include "common/scene/scene_desc.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

/// Members of StrandStyle in their order: lengths in m, counts per strand, and shares.
struct StyleNumbers {
  float clump = 0.0f, locks = 1.0f, spread_m = 0.0f, wave_m = 0.0f, wave_count = 0.0f, frizz_m = 0.0f,
        frizz_count = 0.0f, stray_share = 0.0f, stray_spread = 1.0f, length_spread = 0.0f, short_share = 0.0f;
};

/// Returns the parameters of a look; `mean_length_m` is that of a key strand at rest.
StyleNumbers style_numbers(const LookDesc& look, float mean_length_m);

/// Returns the largest distance of a drawn strand from its key strands, m.
float style_room_m(const StyleNumbers& style);

/// Returns for each root triangle 1 if its hair falls to different sides at rest, else 0. Followers in such a
/// triangle follow only their nearest key strand.
std::vector<uint8_t> parted_triangles(const SceneAsset& asset);
/// Returns the triangles whose hair runs together at rest, for users that interpolate followers from all
/// three keys.
std::vector<RootTriangle> joined_triangles(const SceneAsset& asset);

}  // namespace strandcast

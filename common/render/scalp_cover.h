// Which parts of the head's skin lie under hair. Pure function, any thread.
#pragma once

#include <vector>

#include "common/strands/scene_asset.h"

namespace strandcast {

/// Hair tints the skin this far around the outermost roots, of the hair's extent.
inline constexpr float kCoverReach = 0.025f;

/// Per vertex of the asset's head: 1 between neighbouring roots, however far apart these are, falling
/// smoothly to 0 at `reach_m` beside them, or further where they are further apart. Empty without a head.
std::vector<float> scalp_cover(const SceneAsset& asset, float reach_m);

}  // namespace strandcast

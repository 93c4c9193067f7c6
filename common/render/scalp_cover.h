// Which parts of the head's skin lie under hair. Pure function, any thread.
#pragma once

#include <vector>

#include "common/strands/scene_asset.h"

namespace strandcast {

/// A root tints the skin this far around it, of the hair's extent.
inline constexpr float kCoverReach = 0.025f;

/// Per vertex of the asset's head: 1 where there are as many roots within `reach_m` as in the middle of the
/// hair, 0 where there are none. Empty without a head.
std::vector<float> scalp_cover(const SceneAsset& asset, float reach_m);

}  // namespace strandcast

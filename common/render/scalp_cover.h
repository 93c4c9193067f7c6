// Finds the parts of the head's skin that lie under hair. Pure function, any thread.
#pragma once

#include <vector>

#include "common/strands/scene_asset.h"

namespace strandcast {

/// Distance around the outermost roots in which hair tints the skin, relative to the hair's extent.
inline constexpr float kCoverReach = 0.025f;

/// Returns the cover of each vertex of the asset's head. It is 1 between neighbouring roots and falls
/// smoothly to 0 at `reach_m` beside them, or farther if the roots are farther apart. Empty without a head.
std::vector<float> scalp_cover(const SceneAsset& asset, float reach_m);

}  // namespace strandcast

// What of a groom and a head a viewer needs. Pure function, any thread.
#pragma once

#include "common/groom/groom.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

/// From a uniform groom and a head mesh with one normal per vertex.
SceneAsset make_scene_asset(const Groom& groom, Mesh head);

}  // namespace strandcast

// Makes the asset that viewers need from a groom and a head. Pure function, any thread.
#pragma once

#include "common/groom/groom.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

/// Makes the asset; the groom must be uniform and the head mesh have one normal per vertex.
SceneAsset make_scene_asset(const Groom& groom, Mesh head);

}  // namespace strandcast

// `strandcast-server --check`: a scene's hair and head as loaded, for a person to see whether they lie right,
// without simulation, streams or network.
#pragma once

#include <filesystem>
#include <string>

#include "common/base/result.h"
#include "common/scene/scene_desc.h"
#include "server/app/explain.h"

namespace strandcast {

/// Draws the scene at rest from the front, its left side and above, without head, with the head, and the head
/// with what collides; leaves groom.png and groom.txt in the folder, which is made. Returns the text: what
/// was guessed and why, and how head, colliders and hair agree. Needs a GL device; errors name file or
/// folder.
Result<std::string> check_groom(const SceneDesc& scene, const std::filesystem::path& folder,
                                const MeasureConfig& config);

}  // namespace strandcast

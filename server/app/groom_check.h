// `strandcast-server --check`: a scene's hair and head as loaded, for a person to see whether they lie right,
// without simulation, streams or network.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/groom/mesh.h"
#include "common/scene/scene_desc.h"
#include "server/app/explain.h"

namespace strandcast {

/// Balls as a mesh that can be drawn, and capsules as rows of balls.
Mesh mesh_of_balls(const std::vector<SphereCollider>& balls);
std::vector<SphereCollider> balls_along(const std::vector<BodyCapsule>& capsules);

/// Draws the scene at rest from the front, its left side and above, without head, with the head, and the head
/// with what collides; leaves groom.png and groom.txt in the folder, which is made. Returns the text: what
/// was guessed and why, and how head, colliders and hair agree. Needs a GL device; errors name file or
/// folder.
Result<std::string> check_groom(const SceneDesc& scene, const std::filesystem::path& folder,
                                const MeasureConfig& config);

}  // namespace strandcast

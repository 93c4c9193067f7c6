// `strandcast-server --check`: draws a scene's hair and head as loaded, so that a person can see whether they
// fit, and takes a few steps with its solver. No streams or network.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/groom/mesh.h"
#include "common/scene/scene_desc.h"
#include "server/app/explain.h"

namespace strandcast {

/// Makes a drawable mesh of spheres, and rows of spheres along capsules.
Mesh mesh_of_balls(const std::vector<SphereCollider>& balls);
std::vector<SphereCollider> balls_along(const std::vector<BodyCapsule>& capsules);

/// Draws the scene at rest from the front, left, back and above: hair alone, with the head, and with the
/// colliders. Creates the folder and writes groom.png and groom.txt to it. Returns the text: guesses with
/// reasons, how well head, colliders and hair agree, and what the solver says. Needs a GL device. Errors name
/// the file or folder, and why a server would not start; BadInput also for a unit in which no head has this
/// hair. `on_progress` gets a sentence for each stage: large hair takes most of a minute.
Result<std::string> check_groom(const SceneDesc& scene, const std::filesystem::path& folder,
                                const MeasureConfig& config,
                                const std::function<void(const std::string&)>& on_progress = {});

}  // namespace strandcast

// What of a scene may change while it runs, and how. Pure functions, any thread.
#pragma once

#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

/// Fields that SetParameter may assign to, whole or in part.
const std::vector<std::string>& live_fields();

/// The scene after one assignment to a live field, with the solver's name and parameters checked. Parameters
/// that a newly chosen solver does not have are dropped. Errors name what is known.
Result<SceneDesc> change_scene(const SceneDesc& scene, const std::string& assignment);

/// Checks the solver's name and parameters of a scene.
Status check_solver(const SceneDesc& scene);

}  // namespace strandcast

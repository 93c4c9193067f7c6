// Changes of a scene while it runs, and their rules. Pure functions, any thread.
#pragma once

#include <glm/glm.hpp>
#include <stop_token>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/groom/groom.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

/// Largest number of characters of an assignment in its answer.
inline constexpr size_t kMaxToldChars = 200;

/// Returns the fields that SetParameter may assign, whole or in part.
const std::vector<std::string>& live_fields();

/// Returns the scene after one assignment to a live field, with solver name and parameters checked.
/// Parameters that a newly chosen solver does not have are removed. Errors list the known names.
Result<SceneDesc> change_scene(const SceneDesc& scene, const std::string& assignment);

/// Returns whether an assignment names nothing but the look or the camera.
bool names_look(const std::string& assignment);

/// Returns whether the rest shapes differ: another length or curl of the same groom.
bool is_shaped_otherwise(const SceneDesc& a, const SceneDesc& b);

/// Removes what the scene's solver does not accept: unknown parameters, values out of range, forces between
/// strands, limits of bending.
void fit_to_solver(SceneDesc& scene);

/// Returns a sentence about what fit_to_solver() removed; empty if nothing.
std::string left_out_note(const SceneDesc& before, const SceneDesc& after);

/// Removes the file's parameters that a solver named by overrides does not have. Parameters that the
/// overrides themselves name stay and are checked.
Result<SceneDesc> choose_solver(const SceneDesc& scene, const SolverDesc& scene_solver,
                                const std::vector<std::string>& overrides);

/// Calls SolverRow::prepare of the scene's solver for a groom whose shape is held under this gravity. Returns
/// notes for a person, one sentence each. May take long for a new groom; ends early if told to stop.
Result<std::vector<std::string>> prepare_solver(const SceneDesc& scene, const Groom& groom,
                                                const glm::dvec3& groom_gravity_in_head_mps2,
                                                const std::stop_token& stop = {});

/// Checks the name and parameters of a scene's solver.
Status check_solver(const SceneDesc& scene);

}  // namespace strandcast

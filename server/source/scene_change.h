// What of a scene may change while it runs, and how. Pure functions, any thread.
#pragma once

#include <glm/glm.hpp>
#include <stop_token>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/groom/groom.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

/// Fields that SetParameter may assign to, whole or in part.
const std::vector<std::string>& live_fields();

/// The scene after one assignment to a live field, with the solver's name and parameters checked. Parameters
/// that a newly chosen solver does not take are left out. Errors name what is known.
Result<SceneDesc> change_scene(const SceneDesc& scene, const std::string& assignment);

/// Whether strands at rest are others: another length or other curls of the same groom.
bool is_shaped_otherwise(const SceneDesc& a, const SceneDesc& b);

/// Takes out the parameters that the scene's solver does not have, or not with this value, and what else of
/// the scene it does not take: forces between strands, limits of bending.
void fit_to_solver(SceneDesc& scene);

/// What fit_to_solver took out between the two, as a sentence; empty when nothing.
std::string left_out_note(const SceneDesc& before, const SceneDesc& after);

/// A scene whose overrides named another solver than its file did, without the parameters of the file's that
/// the new one does not take. Parameters that the overrides themselves name stay and are checked.
Result<SceneDesc> choose_solver(const SceneDesc& scene, const SolverDesc& scene_solver,
                                const std::vector<std::string>& overrides);

/// SolverRow::prepare of the scene's solver, for a groom that has its shape under this gravity: what a person
/// should know of it, a sentence each. Takes long where it is new, and ends early when told to stop.
Result<std::vector<std::string>> prepare_solver(const SceneDesc& scene, const Groom& groom,
                                                const glm::dvec3& groom_gravity_in_head_mps2,
                                                const std::stop_token& stop = {});

/// Checks the solver's name and parameters of a scene.
Status check_solver(const SceneDesc& scene);

}  // namespace strandcast

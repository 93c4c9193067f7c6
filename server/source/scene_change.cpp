#include "server/source/scene_change.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "common/scene/scene_file.h"
#include "server/sim/solver_registry.h"
#include "server/source/wet_hair.h"

namespace strandcast {
namespace {

bool bears_volume(const SolverRow& row) {
  return row.has_kernel && row.bears_volume;
}

}  // namespace

const std::vector<std::string>& live_fields() {
  static const std::vector<std::string> kFields = {"solver",
                                                   "substeps",
                                                   "gravity_mps2",
                                                   "follicle_limit_deg",
                                                   "colliders",
                                                   "has_auto_collider",
                                                   "bend_limit",
                                                   "body",
                                                   "volume",
                                                   "air",
                                                   "groom.hairs",
                                                   "quality",
                                                   "hair",
                                                   "detail",
                                                   "wind",
                                                   "look",
                                                   "camera",
                                                   "stream.bound_m",
                                                   "stream.strand_rate_hz"};
  return kFields;
}

bool names_look(const std::string& assignment) {
  const std::string path = assignment.substr(0, assignment.find_first_of("=. "));
  return path == "look" || path == "camera";
}

bool is_shaped_otherwise(const SceneDesc& a, const SceneDesc& b) {
  return a.hair.length != b.hair.length || a.hair.curl != b.hair.curl;
}

Status check_solver(const SceneDesc& scene) {
  ASSIGN_OR_RETURN(const SolverRow* row, find_solver(scene.solver.name));
  if (!row->has_kernel && scene.head.collider == kFieldCollider && scene.has_auto_collider)
    return make_error(ErrorCode::BadInput,
                      "solver {} has no kernel and meets no distance field: head.collider \"{}\" is for it",
                      row->name, kSphereCollider);
  const Result<SolverParameters> parameters = moving_parameters(*row, scene);
  if (!parameters) return parameters.error();
  if (scene.bend_limit.acts() && !row->has_kernel)
    return make_error(ErrorCode::BadInput,
                      "solver {} has no kernel and takes no bend_limit: leave it at 0 and 180", row->name);
  if (scene.wind.along_share < 1.0f && !row->has_kernel)
    return make_error(ErrorCode::BadInput,
                      "solver {} has no kernel and knows no drag by direction: leave wind.along_share at 1",
                      row->name);
  if (scene.body.acts() && !row->has_kernel)
    return make_error(
        ErrorCode::BadInput,
        "solver {} has no kernel and meets no body: body.preset \"{}\" without capsules and planes "
        "is for it",
        row->name, kNoBody);
  if (scene.volume.air.acts && !row->has_kernel)
    return make_error(
        ErrorCode::BadInput,
        "solver {} has no kernel and knows no air that hair carries along: set air.acts to false", row->name);
  if (scene.volume.has_contact() && !bears_volume(*row))
    return make_error(ErrorCode::BadInput,
                      "solver {} takes no forces between strands ({}): set volume.friction_per_s and "
                      "volume.repulsion_per_s2 to 0, or take another solver",
                      row->name,
                      row->has_kernel ? "they would feed its motion for ever" : "it has no kernel");
  return check_step(*row, *parameters, 1.0 / (scene.step_rate_hz * scene.substeps));
}

Result<std::vector<std::string>> prepare_solver(const SceneDesc& scene, const Groom& groom,
                                                const glm::dvec3& groom_gravity_in_head_mps2,
                                                const std::stop_token& stop) {
  ASSIGN_OR_RETURN(const SolverRow* row, find_solver(scene.solver.name));
  ASSIGN_OR_RETURN(const SolverParameters parameters, moving_parameters(*row, scene));
  if (!row->prepare) return std::vector<std::string>{};
  return row->prepare(groom, parameters, groom_gravity_in_head_mps2, stop);
}

void fit_to_solver(SceneDesc& scene) {
  SolverDesc& solver = scene.solver;
  const auto row = find_solver(solver.name);
  if (!row) return;
  if (!bears_volume(**row)) {
    AirDesc air = scene.volume.air;
    air.acts = air.acts && (*row)->has_kernel;
    scene.volume = {};
    scene.volume.air = air;
  }
  if (!(*row)->has_kernel) scene.bend_limit = {};
  if (!(*row)->has_kernel) scene.wind.along_share = WindDesc().along_share;
  if (!(*row)->has_kernel) scene.body = {};
  std::erase_if(solver.parameters, [&](const auto& given) {
    return std::none_of(
        (*row)->parameters.begin(), (*row)->parameters.end(), [&](const SolverParameterInfo& info) {
          const bool is_allowed = given.second >= info.minimum && given.second <= info.maximum;
          return info.name == given.first && is_allowed;
        });
  });
}

std::string left_out_note(const SceneDesc& before, const SceneDesc& after) {
  std::vector<std::string> names;
  for (const auto& [name, value] : before.solver.parameters)
    if (!after.solver.parameters.contains(name)) names.push_back(fmt::format("{} {:g}", name, value));
  if (before.volume.has_contact() && !after.volume.has_contact())
    names.emplace_back("forces between strands (volume)");
  if (before.volume.air.acts && !after.volume.air.acts) names.emplace_back("air");
  if (before.bend_limit.acts() && !after.bend_limit.acts()) names.emplace_back("bend_limit");
  if (before.wind.along_share != after.wind.along_share) names.emplace_back("wind.along_share");
  if (before.body.acts() && !after.body.acts()) names.emplace_back("body");
  if (names.empty() || before.solver.name == after.solver.name) return {};
  return fmt::format("solver {} does not take {}: left out", after.solver.name, fmt::join(names, ", "));
}

Result<SceneDesc> choose_solver(const SceneDesc& scene, const SolverDesc& scene_solver,
                                const std::vector<std::string>& overrides) {
  SceneDesc fitted = scene;
  if (scene.solver.name == scene_solver.name) return fitted;
  fit_to_solver(fitted);
  // What was asked for beside the solver is kept, so that a wrong name or value is told.
  constexpr std::string_view kGroup = "solver.parameters.";
  for (const std::string& assignment : overrides) {
    const std::string path = assignment.substr(0, assignment.find('='));
    if (path.starts_with("volume") || path.starts_with("air")) fitted.volume = scene.volume;
    if (path == "wind.along_share") fitted.wind.along_share = scene.wind.along_share;
    if (path.starts_with("bend_limit")) fitted.bend_limit = scene.bend_limit;
    if (path.starts_with("body")) fitted.body = scene.body;
    if (!path.starts_with(kGroup)) continue;
    const auto given = scene.solver.parameters.find(path.substr(kGroup.size()));
    if (given != scene.solver.parameters.end()) fitted.solver.parameters.insert(*given);
  }
  RETURN_IF_ERROR(check_solver(fitted));
  return fitted;
}

namespace {

/// An override is told as the server's option that makes it, which nobody gave here.
Error without_option(Error error) {
  constexpr std::string_view kOption = "--set ";
  if (error.place.starts_with(kOption)) error.place.erase(0, kOption.size());
  return error;
}

}  // namespace

Result<SceneDesc> change_scene(const SceneDesc& scene, const std::string& assignment) {
  const std::string path = assignment.substr(0, assignment.find_first_of("= "));
  const std::vector<std::string>& fields = live_fields();
  const bool is_live = std::any_of(fields.begin(), fields.end(), [&](const std::string& field) {
    return path == field || path.starts_with(field + ".");
  });
  if (!is_live) {
    // A field that no scene has is said to be unknown.
    if (const auto known = with_overrides(scene, {assignment});
        !known && assignment.find('=') != std::string::npos)
      return without_option(known.error());
    return make_error(ErrorCode::BadInput, "'{}' cannot change while running (known: {})", path,
                      fmt::join(fields, ", "));
  }
  auto with_change = with_overrides(scene, {assignment});
  if (!with_change) return without_option(with_change.error());
  SceneDesc changed = std::move(*with_change);
  // What is loaded stays: a quality that is chosen now meets the head as it is.
  changed.head.collider = scene.head.collider;
  if (changed.solver.name != scene.solver.name) fit_to_solver(changed);
  RETURN_IF_ERROR(check_solver(changed));
  return changed;
}

}  // namespace strandcast

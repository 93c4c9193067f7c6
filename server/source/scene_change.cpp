#include "server/source/scene_change.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "common/scene/scene_file.h"
#include "server/sim/solver_registry.h"

namespace strandcast {

const std::vector<std::string>& live_fields() {
  static const std::vector<std::string> kFields = {
      "solver", "substeps",       "gravity_mps2",         "colliders", "has_auto_collider",
      "wind",   "stream.bound_m", "stream.strand_rate_hz"};
  return kFields;
}

Status check_solver(const SceneDesc& scene) {
  ASSIGN_OR_RETURN(const SolverRow* row, find_solver(scene.solver.name));
  const Result<SolverParameters> parameters = complete_parameters(*row, scene.solver.parameters);
  if (!parameters) return parameters.error();
  return check_step(*row, *parameters, 1.0 / (scene.step_rate_hz * scene.substeps));
}

Result<SceneDesc> change_scene(const SceneDesc& scene, const std::string& assignment) {
  const std::string path = assignment.substr(0, assignment.find_first_of("= "));
  const std::vector<std::string>& fields = live_fields();
  const bool is_live = std::any_of(fields.begin(), fields.end(), [&](const std::string& field) {
    return path == field || path.starts_with(field + ".");
  });
  if (!is_live)
    return make_error(ErrorCode::BadInput, "'{}' cannot change while running (known: {})", path,
                      fmt::join(fields, ", "));
  ASSIGN_OR_RETURN(SceneDesc changed, with_overrides(scene, {assignment}));
  if (changed.solver.name != scene.solver.name) {
    ASSIGN_OR_RETURN(const SolverRow* row, find_solver(changed.solver.name));
    std::erase_if(changed.solver.parameters, [&](const auto& given) {
      return std::none_of(row->parameters.begin(), row->parameters.end(),
                          [&](const SolverParameterInfo& info) { return info.name == given.first; });
    });
  }
  RETURN_IF_ERROR(check_solver(changed));
  return changed;
}

}  // namespace strandcast

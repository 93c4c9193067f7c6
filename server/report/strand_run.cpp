#include "server/report/strand_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <mutex>
#include <string_view>

namespace strandcast {
namespace {

// Parameters of bending and of the pull to the groomed shape, by the words in their names: a limp strand has
// the least of each stiffness and the most of each compliance.
constexpr std::array<std::string_view, 11> kStiffeningWords = {"bend",   "twist",         "torsion",  "style",
                                                               "shape",  "angle",         "altitude", "local",
                                                               "global", "young_modulus", "sag_free"};
constexpr std::string_view kDragName = "air_drag_per_s";

bool has_word(const std::string& name, std::string_view word) {
  return name.find(word) != std::string::npos;
}

SolverParameters base_parameters(const RunSetting& setting, const RunPhysics& physics) {
  if (setting.material == Material::AsShipped || !setting.row->as_hair) return {};
  const double segment_m = physics.length_m / (setting.vertex_count - 1);
  return setting.row->as_hair(physics.hair, segment_m, setting.substep_s());
}

void make_limp(const SolverRow& row, SolverParameters& parameters) {
  for (const SolverParameterInfo& info : row.parameters) {
    const bool is_stiffening = std::any_of(kStiffeningWords.begin(), kStiffeningWords.end(),
                                           [&](std::string_view word) { return has_word(info.name, word); });
    if (is_stiffening) {
      parameters[info.name] = has_word(info.name, "compliance") ? info.maximum : info.minimum;
    } else if (info.name == kDragName) {
      parameters[info.name] = info.minimum;
    }
  }
}

/// A chain let go from horizontal in air hangs straight down in the end.
bool hangs_straight(const SolverRow& row) {
  constexpr uint32_t kVertices = 8;
  constexpr double kDragPerS = 20.0;
  constexpr double kTimeS = 6.0;
  constexpr double kNearly = 0.1;  // lengths of the tip from where it would hang
  RunPhysics physics;
  physics.given = {{std::string(kDragName), kDragPerS}};
  RunSetting setting{&row, Material::Limp, kVertices};
  setting.is_reference = true;
  auto run =
      StrandRun::make({}, setting, physics,
                      groom_of({straight_run(kVertices, physics.length_m, {1.0, 0.0, 0.0})}, Pinning::Root));
  if (!run) return false;
  StepInput input;
  for (int step = 0; step < kTimeS * setting.rate_hz; ++step) run->step(input);
  const glm::dvec3 tip(run->state().position_m.back());
  return glm::distance(tip, glm::dvec3(0.0, -physics.length_m, 0.0)) < kNearly * physics.length_m;
}

}  // namespace

bool has_parameter(const SolverRow& row, const std::string& name) {
  return std::any_of(row.parameters.begin(), row.parameters.end(),
                     [&](const SolverParameterInfo& info) { return info.name == name; });
}

const char* to_string(Material material) {
  switch (material) {
    case Material::Hair:
      return "hair";
    case Material::Limp:
      return "limp";
    case Material::AsShipped:
      return "as shipped";
  }
  return "?";
}

std::string setting_words(const RunSetting& setting) {
  std::string text = fmt::format("{} vertices, {:g} Hz", setting.vertex_count, setting.rate_hz);
  if (setting.substeps > 1) text += fmt::format(", {} substeps", setting.substeps);
  if (!std::isnan(setting.effort))
    text += fmt::format(", {} {:g}", setting.row->effort_parameter, setting.effort);
  if (setting.material != Material::Hair) text += fmt::format(", {}", to_string(setting.material));
  return text;
}

std::string to_string(const RunSetting& setting) {
  return setting.row->name + ", " + setting_words(setting);
}

Result<SolverParameters> run_parameters(const RunSetting& setting, const RunPhysics& physics) {
  SolverParameters given = base_parameters(setting, physics);
  if (setting.material == Material::Limp) make_limp(*setting.row, given);
  for (const auto& [name, value] : physics.given) {
    if (has_parameter(*setting.row, name)) given[name] = value;
  }
  if (!std::isnan(setting.effort)) given[setting.row->effort_parameter] = setting.effort;
  ASSIGN_OR_RETURN(SolverParameters complete, complete_parameters(*setting.row, given));
  RETURN_IF_ERROR(check_step(*setting.row, complete, setting.substep_s()));
  return complete;
}

bool can_be_limp(const SolverRow& row) {
  static std::mutex mutex;
  static std::map<std::string, bool> known;
  const std::lock_guard lock(mutex);
  const auto [found, is_new] = known.try_emplace(row.name, false);
  if (is_new) found->second = hangs_straight(row);
  return found->second;
}

std::vector<double> effort_values(const SolverRow& row, const std::vector<double>& factors) {
  const auto info = std::find_if(
      row.parameters.begin(), row.parameters.end(),
      [&](const SolverParameterInfo& candidate) { return candidate.name == row.effort_parameter; });
  if (info == row.parameters.end()) return {std::numeric_limits<double>::quiet_NaN()};
  std::vector<double> values;
  for (const double factor : factors)
    values.push_back(std::clamp(std::round(factor * info->default_value), info->minimum, info->maximum));
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

Result<StrandRun> StrandRun::make(const Workbench& workbench, const RunSetting& setting,
                                  const RunPhysics& physics, const Groom& groom) {
  ASSIGN_OR_RETURN(const SolverParameters parameters, run_parameters(setting, physics));
  std::unique_ptr<Solver> solver;
  if (workbench.runs_kernel(setting)) {
    SceneFeatures features;
    features.has_wind = features.has_turbulence = true;
    ASSIGN_OR_RETURN(solver, setting.row->make(parameters, {workbench.executor, features}));
  } else {
    solver = setting.row->make_reference(parameters);
  }
  RETURN_IF_ERROR(solver->load(groom, glm::dquat(1.0, 0.0, 0.0, 0.0)));
  return StrandRun(setting, std::move(solver));
}

void StrandRun::step(StepInput input) {
  input.h_s = setting_.substep_s();
  input.head_shift_m /= static_cast<double>(setting_.substeps);
  for (uint32_t i = 0; i < setting_.substeps; ++i) solver_->substep(input);
}

const SolverState& StrandRun::state() {
  solver_->read(state_);
  return state_;
}

bool is_state_finite(const SolverState& state) {
  for (const auto* values : {&state.position_m, &state.velocity_mps}) {
    for (const glm::vec3& value : *values) {
      if (!std::isfinite(value.x) || !std::isfinite(value.y) || !std::isfinite(value.z)) return false;
    }
  }
  return true;
}

double largest_run_stretch(const Groom& groom, const SolverState& state) {
  constexpr double kShortestM = 1e-6;
  const uint32_t strand_count = groom.strand_count();
  double largest = 0.0;
  for (uint32_t s = 0; s < strand_count; ++s) {
    const glm::vec3* rest = groom.rest_position_m.data() + groom.offset[s];
    for (uint32_t i = 1; i < groom.vertex_count(s); ++i) {
      const double rest_m = glm::distance(glm::dvec3(rest[i]), glm::dvec3(rest[i - 1]));
      if (rest_m < kShortestM) continue;
      const double now_m =
          glm::distance(glm::dvec3(state.position_m[(i - 1) * static_cast<size_t>(strand_count) + s]),
                        glm::dvec3(state.position_m[i * static_cast<size_t>(strand_count) + s]));
      const double stretch = std::abs(now_m / rest_m - 1.0);
      if (!(stretch <= largest)) largest = std::isnan(stretch) ? INFINITY : stretch;
    }
  }
  return largest;
}

Groom groom_of(const std::vector<std::vector<glm::dvec3>>& strands, Pinning pinning) {
  Groom groom;
  groom.name = "measured strands";
  groom.offset.push_back(0);
  for (const std::vector<glm::dvec3>& strand : strands) {
    for (const glm::dvec3& point : strand) groom.rest_position_m.emplace_back(point);
    groom.offset.push_back(static_cast<uint32_t>(groom.rest_position_m.size()));
  }
  groom.pinned.assign(groom.rest_position_m.size(), 0);
  return with_pinning(std::move(groom), pinning);
}

std::vector<glm::dvec3> straight_run(uint32_t vertex_count, double length_m, const glm::dvec3& direction) {
  std::vector<glm::dvec3> strand;
  for (uint32_t i = 0; i < vertex_count; ++i)
    strand.push_back(direction * (length_m * i / (vertex_count - 1)));
  return strand;
}

}  // namespace strandcast

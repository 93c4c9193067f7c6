#include "server/report/stability_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/publish/publisher.h"
#include "server/report/stability_observer.h"

namespace strandcast {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();
constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

SolverParameters known_parameters(const SolverRow& row, const SolverParameters& given) {
  SolverParameters known;
  for (const SolverParameterInfo& info : row.parameters)
    if (const auto found = given.find(info.name); found != given.end()) known.insert(*found);
  return known;
}

Pose trial_head_at(const StabilityTrial& trial, double time_s) {
  return trial.head ? trial.head(std::min(time_s, trial.moving_s)) : Pose();
}

void spoil(BadInput bad_input, StepInput& input) {
  if (bad_input == BadInput::ZeroQuaternion) {
    input.world_from_head_rotation = {0.0, 0.0, 0.0, 0.0};
    return;
  }
  const double value = bad_input == BadInput::Infinite ? kUnbounded : kNoNumber;
  input.world_from_head_rotation = {value, value, value, value};
  for (glm::dvec3* vector :
       {&input.head_shift_m, &input.gravity_mps2, &input.groom_gravity_in_head_mps2, &input.wind_mps})
    *vector = glm::dvec3(value);
  input.h_s = value;
}

/// The input of a step from `begin_s` to begin_s + h.
StepInput input_of(const StabilityTrial& trial, double begin_s, double h_s) {
  const Pose before = trial_head_at(trial, begin_s);
  const Pose after = trial_head_at(trial, begin_s + h_s);
  StepInput input;
  input.h_s = h_s;
  input.world_from_head_rotation = after.rotation;
  input.head_shift_m = after.position_m - before.position_m;
  input.gravity_mps2 = trial.gravity_mps2;
  if (trial.is_groom_carried) input.groom_gravity_in_head_mps2 = trial.gravity_mps2;
  if (begin_s < trial.moving_s) input.wind_mps = trial.wind_mps;
  return input;
}

/// Where the strands start instead of the groomed shape.
void set_start(const StabilityTrial& trial, SolverState& state) {
  const glm::dvec3 kick_radps = kKickRadps * glm::normalize(glm::dvec3(1.0, 0.0, 2.0));
  const uint32_t strand_count = trial.groom->strand_count();
  for (uint32_t strand = 0; strand < strand_count; ++strand) {
    const uint32_t begin = trial.groom->offset[strand];
    const auto* rest = trial.groom->rest_position_m.data() + begin;
    const auto* pinned = trial.groom->pinned.data() + begin;
    uint32_t last_pinned = 0;
    for (uint32_t i = 1; i < trial.groom->vertex_count(strand); ++i) {
      if (pinned[i] != 0) {
        last_pinned = i;
        continue;
      }
      const size_t at = static_cast<size_t>(i) * strand_count + strand;
      if (trial.start == StartState::Kicked) {
        const glm::dvec3 arm(rest[i] - rest[last_pinned]);
        state.velocity_mps[at] = glm::vec3(glm::cross(kick_radps, arm));
      } else {
        const glm::vec3 out = glm::normalize(rest[last_pinned] - rest[0]);
        state.position_m[at] =
            state.position_m[at - strand_count] + glm::distance(rest[i], rest[i - 1]) * out;
      }
    }
  }
}

double longest_substep_s(const StabilityTrial& trial) {
  double longest_s = 0.0;
  double time_s = 0.0;
  for (int step = 0; time_s < std::min(trial.moving_s + trial.still_s, 60.0); ++step) {
    longest_s = std::max(longest_s, trial.substep_s(step));
    time_s += trial.substep_s(step);
  }
  return longest_s;
}

/// What every stiffness may be multiplied by before the row refuses the step: by bisection, to a thousandth.
double refused_from(const SolverRow& row, const SolverParameters& complete, double substep_s) {
  double allowed = 1e-9;
  double refused = 1e9;
  while (refused > 1.001 * allowed) {
    const double middle = std::sqrt(allowed * refused);
    const bool is_allowed =
        check_step(row, scale_stiffness(row, complete, middle).parameters, substep_s).ok();
    (is_allowed ? allowed : refused) = middle;
  }
  return refused;
}

void run_steps(const StabilityTrial& trial, Solver& solver, StabilityObserver& observer) {
  constexpr int kSeldom = 1000;
  SolverState state;
  const double end_s = trial.moving_s + trial.still_s;
  double time_s = 0.0;
  bool is_spoilt = false;
  for (int step = 0; time_s < end_s - 1e-9; ++step) {
    const double h_s = trial.substep_s(step);
    StepInput input = input_of(trial, time_s, h_s);
    time_s += h_s;
    const bool is_bad = trial.bad_input != BadInput::None && !is_spoilt && time_s >= 0.5 * trial.moving_s;
    is_spoilt |= is_bad;
    StepInput given = input;
    if (is_bad) spoil(trial.bad_input, given);
    solver.substep(given);
    if (trial.is_checked_seldom && step % kSeldom < kSeldom - 2) continue;
    solver.read(state);
    if (trial.is_checked_seldom && step % kSeldom == kSeldom - 2) {
      observer.skip_to(state);
      continue;
    }
    observer.step(state, input, time_s);
  }
}

}  // namespace

Result<Solver*> StabilityRunner::solver_for(const SolverRow& row, const SolverParameters& complete) {
  if (row_name_ != row.name) solvers_.clear();
  row_name_ = row.name;
  std::unique_ptr<Solver>& solver = solvers_[complete];
  if (solver == nullptr && row.make && executor_ != nullptr) {
    SceneFeatures features;
    features.has_wind = true;
    ASSIGN_OR_RETURN(solver, row.make(complete, {executor_, features}));
  } else if (solver == nullptr) {
    solver = row.make_reference(complete);
  }
  return solver.get();
}

Result<StabilityOutcome> StabilityRunner::run(const SolverRow& row, const StabilityTrial& trial) {
  StabilityOutcome outcome{row.name, trial.group, trial.setting, "", "", {}};
  ASSIGN_OR_RETURN(SolverParameters complete, complete_parameters(row, known_parameters(row, trial.given)));
  double factor = trial.stiffness_factor;
  if (trial.share_of_limit > 0.0)
    factor = trial.share_of_limit * refused_from(row, complete, longest_substep_s(trial));
  if (factor != 1.0) {
    ScaledStiffness scaled = scale_stiffness(row, complete, factor);
    complete = std::move(scaled.parameters);
    outcome.note = scaled.note.empty() ? "no stiffness to raise" : std::move(scaled.note);
  }
  if (const Status allowed = check_step(row, complete, longest_substep_s(trial)); !allowed) {
    outcome.refusal = allowed.error().message;
    return outcome;
  }
  if (row.prepare && trial.is_groom_carried) {
    ASSIGN_OR_RETURN(const auto notes, row.prepare(*trial.groom, complete, trial.gravity_mps2, {}));
    outcome.note += fmt::format("{}{}", outcome.note.empty() ? "" : "; ", fmt::join(notes, "; "));
  }
  ASSIGN_OR_RETURN(Solver * solver, solver_for(row, complete));
  const glm::dquat first_rotation = trial_head_at(trial, 0.0).rotation;
  RETURN_IF_ERROR(solver->load(*trial.groom, first_rotation));
  SolverState state;
  solver->read(state);
  if (trial.start != StartState::Groomed) {
    set_start(trial, state);
    solver->write(state);
  }
  StabilityObserver observer(trial, first_rotation);
  observer.begin(state);
  run_steps(trial, *solver, observer);
  const auto values = observer.values(trial_head_at(trial, trial.moving_s + trial.still_s).rotation);
  for (size_t i = 0; i < kStabilityMeasureCount; ++i) {
    const auto measure = static_cast<StabilityMeasure>(i);
    if (!trial.measures(measure)) continue;
    StabilityCell cell{values[i], stability_promise(row, trial, measure), nullptr};
    for (const KnownBreak& known : known_breaks()) {
      const bool is_here = row.name == known.row && trial.group == known.group &&
                           trial.setting == known.setting && measure == known.measure;
      if (is_here) cell.known_break = &known;
    }
    outcome.cells[i] = cell;
  }
  return outcome;
}

}  // namespace strandcast

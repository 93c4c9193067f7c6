// StabilityTrial: a stiff or extreme case for a few strands: head motion, step size, start state and
// measures. Plain data; any thread.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/groom/groom.h"
#include "common/math/pose.h"
#include "server/sim/solver_registry.h"

namespace strandcast {

enum class StabilityMeasure {
  Finite,   // steps with a number that is none
  Stretch,  // largest change of a segment's length, relative
  Speed,    // largest speed relative to the head joint, m/s
  Energy,   // largest growth of the mechanical energy, relative
  Rest,     // time until nothing moves any more, s
  Jitter,   // rms of the acceleration in the upper half of what steps can show, m/s^2
  Style,    // largest distance from where the strands should end, m
};
inline constexpr size_t kStabilityMeasureCount = 7;
/// Returns the measure's name: "finite", "stretch", ...
const char* name_of(StabilityMeasure measure);

enum class StartState {
  Groomed,  // at rest in the groomed shape
  Kicked,   // groomed shape, turning about the roots; no gravity
  Taut,     // straight out from the root, lengths exact, at rest
};

/// Angular rate of a start state with a kick.
inline constexpr double kKickRadps = 20.0;

/// Invalid value in the input of one step.
enum class BadInput { None, NotANumber, Infinite, ZeroQuaternion };

struct StabilityTrial {
  std::string group;    // trials of one kind: "stiffness", "step", ...
  std::string setting;  // within the group: "x1e+06", "1/30 s"
  std::shared_ptr<const Groom> groom;
  SolverParameters given;         // as far as the row knows them
  double stiffness_factor = 1.0;  // on every stiffness of the row, see scale_stiffness()
  std::string needs_parameter;    // rows without it are not asked; "" = all are
  double share_of_limit = 0.0;    // above 0: stiffnesses at this share of where the row begins to refuse them
  StartState start = StartState::Groomed;
  BadInput bad_input = BadInput::None;        // of the step that ends half of moving_s
  std::function<Pose(double time_s)> head;    // empty: stands still; stops dead at moving_s
  std::function<double(int step)> substep_s;  // of the given step, from 0
  double moving_s = 0.0;
  double still_s = 0.0;  // afterwards
  glm::dvec3 gravity_mps2{0.0, -9.81, 0.0};
  bool is_groom_carried = true;    // sag-free grooms keep their shape under gravity
  glm::dvec3 wind_mps{0.0};        // while moving
  double fair_speed_mps = 0.0;     // relative to the head, that nothing need exceed
  bool is_checked_seldom = false;  // of very many steps only each thousandth is looked at
  std::array<bool, kStabilityMeasureCount> measured{true, true, false, false, false, false, false};

  bool measures(StabilityMeasure measure) const { return measured[static_cast<size_t>(measure)]; }
};

enum class StabilityGrid {
  Reduced,  // for tests: as Quick, with short rests
  Quick,
  Full,
};
struct RestLengths {
  double rest_s;
  int many_steps;
};
/// Returns the durations of the trials at rest.
RestLengths rest_lengths(StabilityGrid grid);

/// Returns whether the trial applies to the row.
bool is_for(const SolverRow& row, const StabilityTrial& trial);

/// Returns all trials; each row runs those that apply to it.
std::vector<StabilityTrial> make_stability_trials(StabilityGrid grid);

/// Complete parameters with every stiffness multiplied and every compliance divided by `factor`, clamped to
/// their ranges. `note` lists the changes and what was clamped.
struct ScaledStiffness {
  SolverParameters parameters;
  std::string note;
};
ScaledStiffness scale_stiffness(const SolverRow& row, const SolverParameters& complete, double factor);

}  // namespace strandcast

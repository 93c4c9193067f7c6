#include "server/report/stability_trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/hash.h"

namespace strandcast {
namespace {
constexpr double kTrialStepS = 1.0 / 60.0;
constexpr double kStandardGravityMps2 = 9.80665;
const glm::dvec3 kUp(0.0, 1.0, 0.0);
const glm::dvec3 kTrialSideways(1.0, 0.0, 0.0);

using Curve = std::vector<glm::vec3>;

std::shared_ptr<const Groom> groom_of(const std::vector<Curve>& strands) {
  auto groom = std::make_shared<Groom>();
  groom->name = "stability";
  groom->offset.push_back(0);
  for (const Curve& strand : strands) {
    groom->rest_position_m.insert(groom->rest_position_m.end(), strand.begin(), strand.end());
    groom->offset.push_back(static_cast<uint32_t>(groom->rest_position_m.size()));
  }
  groom->pinned.assign(groom->rest_position_m.size(), 0);
  return std::make_shared<const Groom>(with_pinning(std::move(*groom), Pinning::RootPair));
}

/// From the head's surface along a direction that turns by `bend_rad` towards another one, segment by
/// segment.
Curve bent_curve(const glm::dvec3& normal, const glm::dvec3& side, const std::vector<double>& segments_m,
                 double bend_rad) {
  constexpr double kHeadRadiusM = 0.1;
  glm::dvec3 point = kHeadRadiusM * normal;
  Curve curve = {glm::vec3(point)};
  for (size_t i = 0; i < segments_m.size(); ++i) {
    const double angle = bend_rad * static_cast<double>(i) / static_cast<double>(segments_m.size());
    point += segments_m[i] * (std::cos(angle) * normal + std::sin(angle) * side);
    curve.emplace_back(point);
  }
  return curve;
}

constexpr int kTrialStrands = 7;
constexpr double kGoldenAngleRad = 2.4;

/// Strands of 0.25 m over the upper half of a head, each bent in a plane of its own.
std::shared_ptr<const Groom> bent_groom(const std::vector<double>& segments_m) {
  constexpr double kBendRad = 0.8;
  std::vector<Curve> strands;
  for (int s = 0; s < kTrialStrands; ++s) {
    const double up = 0.15 + 0.8 * s / (kTrialStrands - 1.0);
    const double level = std::sqrt(1.0 - up * up);
    const glm::dvec3 normal(level * std::cos(kGoldenAngleRad * s), up, level * std::sin(kGoldenAngleRad * s));
    const glm::dvec3 side = glm::normalize(glm::cross(normal, glm::dvec3(0.3, 0.2 + 0.1 * s, 0.9)));
    strands.push_back(bent_curve(normal, side, segments_m, kBendRad));
  }
  return groom_of(strands);
}

/// The same strands leaving the sides of the head and turning down, as a comb leaves them.
std::shared_ptr<const Groom> hanging_groom(const std::vector<double>& segments_m) {
  constexpr double kBendRad = 1.9;
  std::vector<Curve> strands;
  for (int s = 0; s < kTrialStrands; ++s) {
    const double up = 0.3 * s / (kTrialStrands - 1.0);
    const double level = std::sqrt(1.0 - up * up);
    const glm::dvec3 normal(level * std::cos(kGoldenAngleRad * s), up, level * std::sin(kGoldenAngleRad * s));
    const glm::dvec3 side = glm::normalize(-kUp + normal * glm::dot(kUp, normal));
    strands.push_back(bent_curve(normal, side, segments_m, kBendRad));
  }
  return groom_of(strands);
}

std::vector<double> even_segments_m(int vertex_count) {
  constexpr double kLengthM = 0.25;
  return std::vector<double>(static_cast<size_t>(vertex_count) - 1, kLengthM / (vertex_count - 1));
}

/// The 15 segments of a strand of 0.25 m, every third one shortened to `short_m`.
std::vector<double> uneven_segments_m(double short_m) {
  std::vector<double> segments = even_segments_m(16);
  for (size_t i = 2; i < segments.size(); i += 3) segments[i] = short_m;
  return segments;
}

std::shared_ptr<const Groom> upright_groom() {
  constexpr double kTiltRad = 1e-3;  // so that it knows where to fall
  return groom_of({bent_curve(kUp, kTrialSideways, even_segments_m(16), kTiltRad)});
}

std::shared_ptr<const Groom> standard_groom() {
  static const std::shared_ptr<const Groom> groom = bent_groom(even_segments_m(16));
  return groom;
}

std::function<double(int)> every(double substep_s) {
  return [substep_s](int) { return substep_s; };
}

/// Evenly spread over the decade and a half from 1/240 s to 1/10 s; the same in every run.
double random_substep_s(int step) {
  constexpr double kShortestS = 1.0 / 240.0;
  constexpr double kLongestS = 1.0 / 10.0;
  constexpr uint32_t kSeed = 20260u;
  const double share = unit_float(mix_u32(kSeed + static_cast<uint32_t>(step)));
  return kShortestS * std::pow(kLongestS / kShortestS, share);
}

// ---- what heads do ----

Pose turned(double angle_rad, const glm::dvec3& axis) {
  return {glm::dvec3(0.0), glm::angleAxis(angle_rad, axis)};
}

/// To and fro with this largest acceleration.
Pose shake(double time_s, double acceleration_mps2) {
  constexpr double kShakeHz = 4.0;
  const double rate = 2.0 * std::numbers::pi * kShakeHz;
  return {kTrialSideways * (acceleration_mps2 / (rate * rate)) * std::sin(rate * time_s),
          {1.0, 0.0, 0.0, 0.0}};
}

/// Up and down by one radian with this largest rate.
Pose nod(double time_s, double rate_radps) {
  return turned(std::sin(rate_radps * time_s), kTrialSideways);
}

/// -1 .. 1 and back at constant speed, one way in `leg_s`.
double zigzag(double time_s, double leg_s) {
  const double phase = std::fmod(time_s / leg_s, 2.0);
  return phase < 1.0 ? 2.0 * phase - 1.0 : 3.0 - 2.0 * phase;
}

constexpr double kReversalS = 0.05;

Pose reversals_turning(double time_s) {
  return turned(0.5 * std::numbers::pi * (1.0 + zigzag(time_s, kReversalS)), kUp);
}
Pose reversals_moving(double time_s) {
  constexpr double kSpeedMps = 2.0;
  return {kTrialSideways * (0.5 * kReversalS * kSpeedMps * zigzag(time_s, kReversalS)), {1.0, 0.0, 0.0, 0.0}};
}

Pose teleport(double time_s) {
  constexpr double kJumpS = 0.5;
  return {time_s < kJumpS ? glm::dvec3(0.0) : kTrialSideways, {1.0, 0.0, 0.0, 0.0}};
}

/// Two steps forward and two steps of braking, each with this acceleration, after half a second.
Pose burst(double time_s) {
  constexpr double kAccelerationMps2 = 1000.0;
  constexpr double kBeginS = 0.5;
  constexpr double kHalfS = 2.0 * kTrialStepS;
  const double t = std::clamp(time_s - kBeginS, 0.0, 2.0 * kHalfS);
  const double left_s = 2.0 * kHalfS - t;
  const double way_m = t < kHalfS ? 0.5 * kAccelerationMps2 * t * t
                                  : kAccelerationMps2 * (kHalfS * kHalfS - 0.5 * left_s * left_s);
  return {kTrialSideways * way_m, {1.0, 0.0, 0.0, 0.0}};
}

/// What a lively head does: sways and nods.
Pose lively(double time_s) {
  Pose pose;
  pose.position_m = {0.08 * std::sin(5.0 * time_s), 0.03 * std::sin(7.0 * time_s),
                     0.05 * std::cos(4.0 * time_s)};
  pose.rotation = glm::angleAxis(0.5 * std::sin(4.0 * time_s), glm::normalize(glm::dvec3(1.0, 0.4, -0.2)));
  return pose;
}

// ---- trials ----

using Measures = std::vector<StabilityMeasure>;

class TrialList {
 public:
  explicit TrialList(StabilityGrid grid) : grid_(grid) {}

  StabilityGrid grid() const { return grid_; }

  StabilityTrial& add(const std::string& group, const std::string& setting, const Measures& measures) {
    StabilityTrial trial;
    trial.group = group;
    trial.setting = setting;
    trial.groom = standard_groom();
    trial.substep_s = every(kTrialStepS);
    for (const StabilityMeasure measure : measures) trial.measured[static_cast<size_t>(measure)] = true;
    trials_.push_back(std::move(trial));
    return trials_.back();
  }

  std::vector<StabilityTrial> take() { return std::move(trials_); }

 private:
  StabilityGrid grid_;
  std::vector<StabilityTrial> trials_;
};

/// A little more than what a strand gains falling by twice its length, and twice that of a rigid one: no whip
/// of damped hair is faster.
double fair_speed_mps(const StabilityTrial& trial) {
  constexpr double kReachM = 0.35;
  constexpr double kLengthM = 0.25;
  constexpr double kWhip = 2.0;
  double fastest_mps = glm::length(trial.wind_mps);
  for (double time_s = 0.0; trial.head && time_s < trial.moving_s; time_s += kTrialStepS) {
    const Pose before = trial.head(time_s);
    const Pose after = trial.head(time_s + kTrialStepS);
    const double turn_rad = angle_between_rad(before.rotation, after.rotation);
    fastest_mps = std::max(
        fastest_mps, (glm::distance(before.position_m, after.position_m) + kReachM * turn_rad) / kTrialStepS);
  }
  if (trial.start == StartState::Kicked) fastest_mps += kKickRadps * kLengthM;
  return kWhip * (fastest_mps + std::sqrt(4.0 * glm::length(trial.gravity_mps2) * kLengthM));
}

constexpr double kTrialRestS = 12.0;  // a little more than the promise

void add_stiffness(TrialList& list) {
  const int stride = list.grid() == StabilityGrid::Full ? 1 : 3;
  for (int decade = 0; decade <= 9; decade += stride) {
    StabilityTrial& trial = list.add("stiffness", fmt::format("x1e{}", decade), {StabilityMeasure::Speed});
    trial.stiffness_factor = std::pow(10.0, decade);
    trial.head = lively;
    trial.moving_s = 3.0;
    trial.still_s = 1.0;
  }
}

void add_steps(TrialList& list) {
  const Measures measures = {StabilityMeasure::Speed};
  for (const int rate_hz : {240, 120, 60, 30, 15, 10}) {
    StabilityTrial& trial = list.add("step", fmt::format("1/{} s", rate_hz), measures);
    trial.head = lively;
    trial.substep_s = every(1.0 / rate_hz);
    trial.moving_s = 4.0;
    trial.still_s = 1.0;
  }
  StabilityTrial& trial = list.add("step", "varying 1/240 to 1/10 s", measures);
  trial.head = lively;
  trial.substep_s = random_substep_s;
  trial.moving_s = 20.0;
  trial.still_s = 1.0;
}

void add_motions(TrialList& list) {
  struct Motion {
    const char* name;
    std::function<Pose(double)> head;
    double seconds;
  };
  const double acceleration_mps2 = 10.0 * kStandardGravityMps2;
  const std::vector<Motion> motions = {
      {"10 g head shake", [=](double t) { return shake(t, acceleration_mps2); }, 2.0},
      {"20 rad/s nod", [](double t) { return nod(t, 20.0); }, 2.0},
      {"180-degree turns, 50 ms each", reversals_turning, 2.0},
      {"2 m/s, reversed every 50 ms", reversals_moving, 2.0},
      {"1 m teleport in one frame", teleport, 1.0},
      {"1000 m/s2 at the root", burst, 1.0},
  };
  for (const Motion& motion : motions) {
    StabilityTrial& trial = list.add(
        "motion", motion.name, {StabilityMeasure::Speed, StabilityMeasure::Rest, StabilityMeasure::Jitter});
    trial.head = motion.head;
    trial.moving_s = motion.seconds;
    trial.still_s = kTrialRestS;
  }
  StabilityTrial& wind =
      list.add("motion", "wind of 80 m/s",
               {StabilityMeasure::Speed, StabilityMeasure::Rest, StabilityMeasure::Jitter});
  wind.wind_mps = {80.0, 0.0, 0.0};
  wind.moving_s = 2.0;
  wind.still_s = kTrialRestS;
}

void add_grooms(TrialList& list) {
  const std::pair<const char*, std::shared_ptr<const Groom>> grooms[] = {
      {"zero-length segments", bent_groom(uneven_segments_m(0.0))},
      {"segments of 1e-7 m", bent_groom(uneven_segments_m(1e-7))},
      {"all vertices in one place", bent_groom(std::vector<double>(15, 0.0))},
      {"3 vertices", bent_groom(even_segments_m(3))},
      {"64 vertices", bent_groom(even_segments_m(64))},
  };
  for (const auto& [name, groom] : grooms) {
    StabilityTrial& trial = list.add("groom", name, {StabilityMeasure::Speed});
    trial.groom = groom;
    trial.head = [](double t) { return shake(t, 3.0 * kStandardGravityMps2); };
    trial.moving_s = 2.0;
    trial.still_s = 1.0;
  }
}

void add_bad_inputs(TrialList& list) {
  const std::pair<const char*, BadInput> inputs[] = {{"NaN in everything", BadInput::NotANumber},
                                                     {"infinity in everything", BadInput::Infinite},
                                                     {"zero quaternion", BadInput::ZeroQuaternion}};
  for (const auto& [name, bad_input] : inputs) {
    StabilityTrial& trial = list.add("input", name, {StabilityMeasure::Style});
    trial.groom = hanging_groom(even_segments_m(16));
    trial.given = {{"sag_free", 1.0}};
    trial.bad_input = bad_input;
    trial.moving_s = 1.0;
    trial.still_s = kTrialRestS;
  }
}

/// Explicit integrators on either side of where theory ends them.
void add_explicit_limits(TrialList& list) {
  const std::pair<const char*, double> integrators[] = {{"symplectic Euler", 0.0}, {"Verlet", 1.0}};
  for (const auto& [name, integrator] : integrators) {
    for (const double share : {0.95, 1.05}) {
      StabilityTrial& trial = list.add(
          "explicit", fmt::format("{}, {:g} of the stiffness limit", name, share), {StabilityMeasure::Speed});
      trial.needs_parameter = "integrator";
      // Dampers take from what is stable as well, and short segments from the masses.
      trial.given = {{"integrator", integrator},
                     {"stretch_damping_ns_per_m", 0.0},
                     {"shortest_segment_m", even_segments_m(16)[0]}};
      trial.share_of_limit = share;
      trial.head = lively;
      trial.moving_s = 4.0;
      trial.still_s = 2.0;
    }
  }
}

void add_energies(TrialList& list) {
  StabilityTrial& fall =
      list.add("energy", "falls from the groomed shape", {StabilityMeasure::Energy, StabilityMeasure::Speed});
  fall.is_groom_carried = false;
  fall.given = {{"sag_free", 0.0}};
  fall.still_s = 10.0;
  StabilityTrial& kick =
      list.add("energy", "kicked, no gravity", {StabilityMeasure::Energy, StabilityMeasure::Speed});
  kick.start = StartState::Kicked;
  kick.gravity_mps2 = glm::dvec3(0.0);
  kick.is_groom_carried = false;
  kick.still_s = fall.still_s;
  StabilityTrial& upright =
      list.add("energy", "buckles from upright", {StabilityMeasure::Energy, StabilityMeasure::Rest});
  upright.groom = upright_groom();
  upright.is_groom_carried = false;
  upright.given = {{"sag_free", 0.0}};
  upright.still_s = kTrialRestS;
  StabilityTrial& taut =
      list.add("energy", "pulled taut, released",
               {StabilityMeasure::Speed, StabilityMeasure::Rest, StabilityMeasure::Jitter});
  taut.start = StartState::Taut;
  taut.still_s = kTrialRestS;
}

void add_rests(TrialList& list) {
  const RestLengths lengths = rest_lengths(list.grid());
  const Measures measures = {StabilityMeasure::Style, StabilityMeasure::Jitter, StabilityMeasure::Speed};
  for (const bool is_standing : {false, true}) {
    StabilityTrial& rest = list.add("rest", is_standing ? "standing hair" : "hanging hair", measures);
    rest.groom = is_standing ? standard_groom() : hanging_groom(even_segments_m(16));
    rest.given = {{"sag_free", 1.0}};
    rest.still_s = lengths.rest_s;
  }
  StabilityTrial& rest =
      list.add("rest", "hanging hair, many steps", {StabilityMeasure::Style, StabilityMeasure::Speed});
  rest.groom = hanging_groom(even_segments_m(16));
  rest.given = {{"sag_free", 1.0}};
  rest.still_s = lengths.many_steps * kTrialStepS;
  rest.is_checked_seldom = true;
}

bool contains(const std::string& text, const char* part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

const char* name_of(StabilityMeasure measure) {
  constexpr const char* kNames[kStabilityMeasureCount] = {"finite", "stretch", "speed", "energy",
                                                          "rest",   "jitter",  "style"};
  return kNames[static_cast<size_t>(measure)];
}

bool is_for(const SolverRow& row, const StabilityTrial& trial) {
  return trial.needs_parameter.empty() ||
         std::any_of(row.parameters.begin(), row.parameters.end(), [&trial](const SolverParameterInfo& info) {
           return info.name == trial.needs_parameter;
         });
}

RestLengths rest_lengths(StabilityGrid grid) {
  constexpr double kTenMinutesS = 600.0;
  constexpr double kOneMinuteS = 60.0;
  constexpr double kTenSecondsS = 10.0;
  if (grid == StabilityGrid::Full) return {kTenMinutesS, 1'000'000};
  return grid == StabilityGrid::Quick ? RestLengths{kOneMinuteS, 20'000} : RestLengths{kTenSecondsS, 2'000};
}

std::vector<StabilityTrial> make_stability_trials(StabilityGrid grid) {
  TrialList list(grid);
  add_stiffness(list);
  add_steps(list);
  add_explicit_limits(list);
  add_motions(list);
  add_grooms(list);
  add_bad_inputs(list);
  add_energies(list);
  add_rests(list);
  std::vector<StabilityTrial> trials = list.take();
  for (StabilityTrial& trial : trials) trial.fair_speed_mps = fair_speed_mps(trial);
  return trials;
}

ScaledStiffness scale_stiffness(const SolverRow& row, const SolverParameters& complete, double factor) {
  ScaledStiffness scaled{complete, ""};
  for (const SolverParameterInfo& info : row.parameters) {
    const bool is_stiffness = contains(info.name, "stiffness") || contains(info.name, "modulus");
    const bool is_compliance = contains(info.name, "compliance");
    if (!is_stiffness && !is_compliance) continue;
    double& value = scaled.parameters[info.name];
    const double asked = is_compliance ? value / factor : value * factor;
    const double before = value;
    value = std::clamp(asked, info.minimum, info.maximum);
    if (value == before) continue;
    scaled.note += fmt::format("{}{} {:.3g} -> {:.3g}{}", scaled.note.empty() ? "" : ", ", info.name, before,
                               value, value == asked ? "" : " (as far as it goes)");
  }
  return scaled;
}

}  // namespace strandcast

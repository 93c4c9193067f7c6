#include <fmt/format.h>

#include <algorithm>

#include "common/base/check.h"
#include "server/publish/publisher.h"
#include "server/report/stability_run.h"

namespace strandcast {
namespace {

// Float positions half a metre from the head, in segments of 4 mm: 6e-8 m / 4e-3 m, and a margin.
constexpr double kExactStretch = 1e-4;
// Mass lumped at vertices and single precision.
constexpr double kEnergyGrowth = 0.01;
// Row field comes_to_rest.
constexpr double kTimeToRestS = 10.0;
// What a vertex has that is 0.1 mm, the stream's default error bound, to either side in alternate steps of
// 1/60 s: 4 A / h^2. Less cannot be seen.
constexpr double kVisibleJitterMps2 = 4.0 * 1e-4 * 60.0 * 60.0;
// The stream's default error bound; ten times that after a disturbance, within twelve seconds.
constexpr double kStyleM = 1e-4;
constexpr double kRecoveredStyleM = 1e-3;

// Of iterated constraints: what is left of the stretch after the iterations of one step.
constexpr const char* kIterationsLeaveStretch =
    "the iterations of a step carry a jolt only so many segments along the strand, and what is left "
    "stretches "
    "those near the root; it is gone within a fraction of a second. More iterations or substeps, or "
    "direct_rod";

}  // namespace

StabilityPromise stability_promise(const SolverRow& row, const StabilityTrial& trial,
                                   StabilityMeasure measure) {
  switch (measure) {
    case StabilityMeasure::Finite:
      return {0.0};
    case StabilityMeasure::Stretch:
      return {row.stretch_bound > 0.0 ? std::max(row.stretch_bound, kLeastOverstretch) : kExactStretch};
    case StabilityMeasure::Speed:
      return {trial.fair_speed_mps};
    case StabilityMeasure::Energy:
      return {kEnergyGrowth};
    case StabilityMeasure::Rest:
      return {kTimeToRestS, row.comes_to_rest};
    case StabilityMeasure::Jitter:
      return {kVisibleJitterMps2};
    case StabilityMeasure::Style:
      return {trial.bad_input == BadInput::None ? kStyleM : kRecoveredStyleM};
  }
  CHECK(false);
  return {};
}

std::string promise_reason(StabilityMeasure measure) {
  switch (measure) {
    case StabilityMeasure::Finite:
      return "Steps after which a position or velocity was no finite number. None may be, whatever comes in.";
    case StabilityMeasure::Stretch:
      return fmt::format(
          "Largest change of a segment's length, relative to it. Rows with exact lengths: rounding. Others: "
          "{:g} %, or the row's bound where that is more. A running server lets up to {:g} times that bound "
          "pass before it puts a strand back to rest.",
          100.0 * kLeastOverstretch, kOverstretchPerBound);
    case StabilityMeasure::Speed:
      return "Largest speed of a vertex relative to the head, as seen, m/s. Twice the sum of what a rigid "
             "strand does "
             "in the trial and what a strand gains that falls by twice its length; wind counts as motion.";
    case StabilityMeasure::Energy:
      return fmt::format(
          "Largest growth of kinetic energy and height over what the strand began with, relative to its "
          "weight times its length, or to the kick. Strands are damped and nothing drives them: none. {:g} % "
          "is allowed for mass lumped at vertices.",
          100.0 * kEnergyGrowth);
    case StabilityMeasure::Rest:
      return fmt::format(
          "Seconds after the head stopped until no vertex moves by more than 0.1 mm in 1/60 s: {:g}, the "
          "promise of every row that comes to rest.",
          kTimeToRestS);
    case StabilityMeasure::Jitter:
      return "Acceleration in the upper half of the frequencies that steps can show, root mean square over "
             "two "
             "seconds from one second after the head has stopped, of the worst vertex, m/s2. The limit is "
             "what a "
             "vertex has that is 0.1 mm to either side in alternate steps.";
    case StabilityMeasure::Style:
      return fmt::format(
          "Largest distance from the groomed shape at the end, m: {:g} mm at rest, the default error of the "
          "strand stream; {:g} mm within twelve seconds of a bad input.",
          1e3 * kStyleM, 1e3 * kRecoveredStyleM);
  }
  CHECK(false);
  return {};
}

const std::vector<KnownBreak>& known_breaks() {
  using Measure = StabilityMeasure;
  constexpr const char* kCompressed =
      "the velocity correction of DFTL puts on a vertex what its follower was moved, with no mass behind it; "
      "in a strand under pressure that does work from nothing";
  constexpr const char* kUnfinishedSweeps =
      "odd and even sweeps that do not reach the tip leave a rest that differs from step to step after a "
      "jolt "
      "and dies away slowly; dftl does not have it";
  constexpr const char* kStaticFollow =
      "static Follow-The-Leader takes velocities from projected positions and gives the leader no share: it "
      "feeds itself (Mueller et al. 2012, section 3)";
  constexpr const char* kDraggedAlong =
      "a vertex that moves drags the others along by geometry, with no mass behind it: a kick or a push "
      "along "
      "the strand does work from nothing, which drag and the velocity correction take out again";
  constexpr const char* kOnlyTheTip =
      "only the tip has mass; the energy here counts that of the vertices which it drags";
  constexpr const char* kFinishedLengths =
      "sweeps put lengths right where the constraints have left vertices too low, and lift them for nothing";
  constexpr const char* kTooStiffForFloat =
      "from a million times the stiffness of hair on, its bending forces leave single precision no room for "
      "inertia; the double reference moves as a rigid strand";
  static const std::vector<KnownBreak> breaks = {
      {"dftl", "energy", "buckles from upright", Measure::Energy, 0.0754, kCompressed},
      {"dftl_parallel", "energy", "buckles from upright", Measure::Energy, 0.0755, kCompressed},
      {"dftl_parallel", "motion", "2 m/s, reversed every 50 ms", Measure::Jitter, 61.0, kUnfinishedSweeps},
      {"ftl", "step", "1/240 s", Measure::Speed, 18.2, kStaticFollow},
      {"ftl", "motion", "10 g head shake", Measure::Jitter, 1.53, kStaticFollow},
      {"ftl", "motion", "20 rad/s nod", Measure::Jitter, 5.12, kStaticFollow},
      {"ftl", "motion", "180-degree turns, 50 ms each", Measure::Jitter, 2.90, kStaticFollow},
      {"ftl", "motion", "2 m/s, reversed every 50 ms", Measure::Jitter, 2.92, kStaticFollow},
      {"ftl", "motion", "wind of 80 m/s", Measure::Jitter, 2.19, kStaticFollow},
      {"pbd", "motion", "10 g head shake", Measure::Stretch, 1.29, kIterationsLeaveStretch},
      {"pbd", "motion", "20 rad/s nod", Measure::Stretch, 1.71, kIterationsLeaveStretch},
      {"pbd", "motion", "180-degree turns, 50 ms each", Measure::Stretch, 1.40, kIterationsLeaveStretch},
      {"pbd", "motion", "1 m teleport in one frame", Measure::Stretch, 6.58, kIterationsLeaveStretch},
      {"pbd", "motion", "1000 m/s2 at the root", Measure::Stretch, 5.63, kIterationsLeaveStretch},
      {"pbd", "motion", "wind of 80 m/s", Measure::Stretch, 1.59, kIterationsLeaveStretch},
      {"pbd", "groom", "zero-length segments", Measure::Stretch, 0.509, kIterationsLeaveStretch},
      {"pbd", "groom", "segments of 1e-7 m", Measure::Stretch, 0.509, kIterationsLeaveStretch},
      {"pbd", "groom", "64 vertices", Measure::Stretch, 1.72, kIterationsLeaveStretch},
      {"pbd", "input", "infinity in everything", Measure::Stretch, 31.3, kIterationsLeaveStretch},
      {"xpbd", "motion", "10 g head shake", Measure::Stretch, 0.842, kIterationsLeaveStretch},
      {"xpbd", "motion", "20 rad/s nod", Measure::Stretch, 0.626, kIterationsLeaveStretch},
      {"xpbd", "motion", "180-degree turns, 50 ms each", Measure::Stretch, 0.993, kIterationsLeaveStretch},
      {"xpbd", "motion", "1 m teleport in one frame", Measure::Stretch, 3.45, kIterationsLeaveStretch},
      {"xpbd", "motion", "1000 m/s2 at the root", Measure::Stretch, 2.99, kIterationsLeaveStretch},
      {"xpbd", "motion", "wind of 80 m/s", Measure::Stretch, 0.586, kIterationsLeaveStretch},
      {"xpbd", "groom", "64 vertices", Measure::Stretch, 1.01, kIterationsLeaveStretch},
      {"xpbd", "input", "infinity in everything", Measure::Stretch, 15.3, kIterationsLeaveStretch},
      {"tractrix_emulation", "energy", "kicked, no gravity", Measure::Energy, 1.23, kDraggedAlong},
      {"tractrix_emulation", "energy", "buckles from upright", Measure::Energy, 0.0592, kDraggedAlong},
      {"tractrix_split", "energy", "buckles from upright", Measure::Energy, 0.0564, kOnlyTheTip},
      {"tractrix_hybrid", "energy", "buckles from upright", Measure::Energy, 0.0322, kFinishedLengths},
      {"direct_rod", "stiffness", "x1e6", Measure::Speed, 25.7, kTooStiffForFloat},
      {"direct_rod", "stiffness", "x1e7", Measure::Speed, 15.6, kTooStiffForFloat},
      {"direct_rod", "stiffness", "x1e8", Measure::Speed, 15.6, kTooStiffForFloat},
      {"direct_rod", "stiffness", "x1e9", Measure::Speed, 15.6, kTooStiffForFloat},
  };
  return breaks;
}

}  // namespace strandcast

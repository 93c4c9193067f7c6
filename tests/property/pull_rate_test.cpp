// The pull to the groomed shape brakes a swing by as much a second at any step rate.
#include <numbers>
#include <set>
#include <string>

#include "server/sim/strand_state.h"
#include "tests/support/solver_fixture.h"

namespace strandcast::pull_rate_test {
namespace {

constexpr double kUsualHz = 60.0;
constexpr double kRatesHz[] = {30.0, 120.0, 240.0, 480.0};
constexpr double kPullPerS2 = 400.0;
// Nearly as often as the strand sways by itself, so that it is the braking that says how far.
constexpr double kRocksPerS = 3.0;
constexpr double kRockRad = 0.03;
constexpr double kSettleS = 2.0;
constexpr double kSeconds = 4.0;

Groom hanging_strand() {
  std::vector<glm::vec3> strand;
  for (int i = 0; i < 5; ++i) strand.emplace_back(0.0f, -0.05f * static_cast<float>(i), 0.0f);
  return groom_from({strand}, Pinning::Root);
}

const SolverParameters kPull = {{"style_stiffness_per_s2", kPullPerS2},
                                {"style_tip_share", 1.0},
                                {"air_drag_per_s", 0.0},
                                {"sag_free", 0.0},
                                {"max_speed_mps", 100.0}};

/// Root mean square of the way of the last vertex, seen from a head that rocks. `take` takes a substep and
/// says where the strand is.
template <class Take>
double sway_m(double rate_hz, const Take& take) {
  std::vector<glm::dvec3> ways;
  glm::dvec3 mean(0.0);
  StepInput input = calm_input(1.0 / rate_hz);
  for (int step = 1; step <= static_cast<int>(std::lround(kSeconds * rate_hz)); ++step) {
    const double time_s = step / rate_hz;
    const double angle_rad = kRockRad * std::sin(2.0 * std::numbers::pi * kRocksPerS * time_s);
    input.world_from_head_rotation = glm::angleAxis(angle_rad, glm::dvec3(0.0, 0.0, 1.0));
    const SolverState state = take(input);
    if (time_s <= kSettleS) continue;
    ways.push_back(glm::conjugate(input.world_from_head_rotation) * glm::dvec3(state.position_m.back()));
    mean += ways.back();
  }
  mean /= static_cast<double>(ways.size());
  double sum = 0.0;
  for (const glm::dvec3& way : ways) sum += glm::dot(way - mean, way - mean);
  return std::sqrt(sum / static_cast<double>(ways.size()));
}

class PullRate : public SolverTest {
 protected:
  double sway_of_m(const SolverKind& kind, double rate_hz) {
    auto solver = make(kind, hanging_strand(), kPull);
    return sway_m(rate_hz, [&](const StepInput& input) {
      solver->substep(input);
      return read(*solver);
    });
  }
  /// Of dftl's kernel, which looks a time ahead that may be the substep's own.
  double sway_by_kernel_m(double rate_hz, bool is_per_step) {
    Executor& executor = executors_.on(SimDevice::Lanes);
    StrandState strands(executor);
    EXPECT_TRUE(strands.load(hanging_strand(), {1.0, 0.0, 0.0, 0.0}));
    KernelDesc desc;
    desc.shader_path = "sim/dftl.comp";
    auto program = executor.make_program(desc, {}, strands.layout()).value();
    StrandParameters parameters;
    parameters.s_damping = 0.9;
    parameters.style_stiffness_per_s2 = kPullPerS2;
    parameters.style_tip_share = 1.0;
    parameters.max_speed_mps = 100.0;
    return sway_m(rate_hz, [&](const StepInput& input) {
      StepBlock block = make_step_block(input, parameters, strands.layout().counts(), strands.head());
      if (is_per_step) block.wind.w = block.head_velocity.w;
      program->run(block, 0, strands.planes());
      strands.advance(input);
      SolverState state;
      strands.read(state);
      return state;
    });
  }
};

// Every model that takes the pull on its vertices.
TEST_F(PullRate, StrandsSwayAlikeAtAnyStepRate) {
  const std::set<std::string> pulled = {"dftl",
                                        "ftl",
                                        "pbd",
                                        "xpbd",
                                        "mass_spring",
                                        "tractrix_emulation",
                                        "articulated",
                                        "tractrix_hybrid",
                                        "angular_projection"};
  for (const SolverKind& kind : kinds_of_long_tests()) {
    if (!pulled.contains(kind.row->name)) continue;
    const double usual_m = sway_of_m(kind, kUsualHz);
    EXPECT_GT(usual_m, 0.005) << kind.name();
    for (const double rate_hz : kRatesHz)
      EXPECT_NEAR(sway_of_m(kind, rate_hz) / usual_m, 1.0, 0.15) << kind.name() << ' ' << rate_hz;
  }
}

// Backward Euler, which looks a substep ahead, brakes by the step: the same law fails for it. At the usual
// rate the two are one.
TEST_F(PullRate, LookingASubstepAheadBrakesByTheStep) {
  const double usual_m = sway_by_kernel_m(kUsualHz, false);
  EXPECT_EQ(sway_by_kernel_m(kUsualHz, true), usual_m);
  for (const double rate_hz : kRatesHz)
    EXPECT_NEAR(sway_by_kernel_m(rate_hz, false) / usual_m, 1.0, 0.15) << rate_hz;
  EXPECT_LT(sway_by_kernel_m(30.0, true) / usual_m, 0.75);
  EXPECT_GT(sway_by_kernel_m(480.0, true) / usual_m, 1.5);
}

// The stiffest pull that a scene may ask for, in the longest substep.
TEST_F(PullRate, TheStiffestPullStaysStable) {
  SolverParameters stiffest = kPull;
  stiffest["style_stiffness_per_s2"] = 1e6;
  for (const char* name : {"dftl", "mass_spring"})
    for (const SolverKind& kind : kinds_of(**find_solver(name)))
      for (const double rate_hz : {10.0, 25.0, 60.0, 1000.0}) {
        auto solver = make(kind, hanging_strand(), stiffest);
        const double sway = sway_m(rate_hz, [&](const StepInput& input) {
          solver->substep(input);
          return read(*solver);
        });
        EXPECT_LT(sway, 0.01) << kind.name() << ' ' << rate_hz;
      }
}

}  // namespace
}  // namespace strandcast::pull_rate_test

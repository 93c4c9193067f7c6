// Every solver on every executor against its double-precision reference over a few steps of the same motion.
#include <algorithm>
#include <cmath>
#include <string_view>
#include <tuple>

#include "server/sim/solver_registry.h"
#include "tests/support/sim_devices.h"
#include "tests/support/sim_scene.h"
#include "tests/support/solver_bounds.h"
#include "tests/support/test_grid.h"

namespace strandcast::solver_parity_test {
namespace {

constexpr double kSubstepS = 1.0 / 60.0;

// A float position of 0.3 m is good to 1.5e-8 m. One step divides differences of positions by a segment of a
// few millimetres and adds them up over the strand, and the next step starts from the result: a few hundred
// roundings. For strands of 16 vertices; the sum grows with their number.
constexpr double kBoundM = 1e-5;
constexpr double kBoundVertexCount = 16.0;
// A strand held at both ends is nearly straight: the side of a flat triangle answers to rounding with its
// square root, sqrt(1.5e-8 m x 0.25 m) = 6e-5 m, in each step. A model that never comes to rest passes each
// step's share on to the next, which about doubles it.
constexpr double kHeldBoundM = 5e-4;
constexpr double kRestlessHeldBoundM = 2e-3;

struct ParityCase {
  std::string name;
  Pinning pinning = Pinning::RootPair;
  uint32_t vertex_count = 16;
  bool has_wind = false;
  bool has_gusts = false;
  bool has_colliders = false;
  // Strands that hang: one that stands against gravity buckles to one side or the other, and rounding
  // decides.
  SolverParameters parameters = {{"style_stiffness_per_s2", 120.0}};
  int steps = 6;
  double bend_rad = TestGroomDesc().bend_rad;
  bool has_bust = false;
};

// Short segments divide a rounding: iterated models are given vertices over 8 times as much, in the first
// step.
constexpr double kIteratedVertexCount = 8.0;

double bound_for(const SolverRow& row, const ParityCase& test, int step) {
  const SolverBounds& bounds = bounds_of(row);
  if (test.vertex_count > kBoundVertexCount && bounds.folding_spread_m > 0.0) return bounds.folding_spread_m;
  const double held_bound_m = row.comes_to_rest ? kHeldBoundM : kRestlessHeldBoundM;
  if (bounds.rounding_growth > 1.0) {
    const double bound_m = test.pinning == Pinning::BothEnds ? held_bound_m : kBoundM;
    return bound_m * std::max(1.0, test.vertex_count / kIteratedVertexCount) *
           std::pow(bounds.rounding_growth, step - 1);
  }
  const double bound_m = test.pinning == Pinning::BothEnds
                             ? held_bound_m
                             : kBoundM * std::max(1.0, test.vertex_count / kBoundVertexCount);
  const double squared = static_cast<double>(test.vertex_count) * test.vertex_count;
  return bound_m + bounds.stiff_rounding_m * squared;
}

/// A bust that begins high, so that colliders and what slides on them lie on neck and chest.
BustInput moving_bust(int step) {
  const auto turn_at = [](double t_s) {
    const double half_rad = 0.3 * std::sin(6.0 * t_s);
    return std::sin(half_rad) * glm::normalize(BustTurn(0.2, 1.0, -0.1));
  };
  BustInput bust;
  bust.rig = {glm::vec3(0.0f, 0.03f, -0.01f), glm::vec4(0.0f, 8.0f, 0.0f, 0.9f)};
  bust.turn = turn_at(step * kSubstepS);
  bust.turn_before = turn_at((step - 1) * kSubstepS);
  return bust;
}

StepInput input_for(const ParityCase& test, int step) {
  StepInput input = moving_input(step, kSubstepS);
  if (!test.has_wind) input.wind_mps = glm::dvec3(0.0);
  if (!test.has_gusts) input.gusts.clear();
  if (!test.has_colliders) input.colliders.clear();
  if (test.has_bust) {
    // Strands stand in it from the beginning, on one side of its middle.
    const glm::dvec3 at_rest(0.13, 0.06, 0.02);
    input.bust = moving_bust(step);
    input.colliders = {
        {glm::vec3(input.world_from_head_rotation * with_bust(input.bust.rig, input.bust.turn, at_rest)),
         0.05f}};
  }
  return input;
}

SceneFeatures features_for(const ParityCase& test) {
  SceneFeatures features;
  features.has_wind = test.has_wind;
  features.has_turbulence = test.has_gusts;
  features.has_colliders = test.has_colliders;
  return features;
}

std::vector<ParityCase> parity_cases() {
  return {
      {"motion only"},
      {"root pinned once", Pinning::Root},
      {"both ends pinned", Pinning::BothEnds},
      {"wind", Pinning::RootPair, 16, true},
      {"wind and gusts", Pinning::RootPair, 16, true, true},
      {"colliders", Pinning::RootPair, 16, false, false, true},
      {"everything, both ends", Pinning::BothEnds, 16, true, true, true},
      {"everything, 2 vertices", Pinning::Root, 2, true, true, true},
      {"everything, 7 vertices", Pinning::RootPair, 7, true, true, true},
      {"wind and gusts, 64 vertices", Pinning::RootPair, 64, true, true},
      // Short segments driven straight into a collider may evade to either side, and rounding decides: few
      // steps.
      {"everything, 64 vertices",
       Pinning::RootPair,
       64,
       true,
       true,
       true,
       {{"style_stiffness_per_s2", 120.0}},
       3},
      {"sagging", Pinning::RootPair, 16, true, true, true, {{"sag_free", 0.0}}},
      // Straight hair has a kernel of its own in direct_rod: nothing twists.
      {.name = "straight hair", .has_wind = true, .has_gusts = true, .bend_rad = 0.0},
      // A pull that is strong enough to carry the weight at the root only.
      {"half carried",
       Pinning::RootPair,
       16,
       false,
       false,
       true,
       {{"style_stiffness_per_s2", 30.0}, {"style_tip_share", 0.1}, {"sag_free", 0.4}}},
      {.name = "bust",
       .has_colliders = true,
       .parameters = {{"style_stiffness_per_s2", 120.0}, {"collider_friction", 1.0}},
       .has_bust = true},
      {"limp, rough",
       Pinning::RootPair,
       16,
       true,
       true,
       true,
       {{"style_stiffness_per_s2", 0.0}, {"collider_friction", 2.0}, {"s_damping", 1.0}}},
  };
}

/// Rest positions in the order of SolverState.
std::vector<glm::vec3> groom_positions(const Groom& groom) {
  std::vector<glm::vec3> result;
  for (uint32_t i = 0; i < groom.vertex_count(0); ++i) {
    for (uint32_t s = 0; s < groom.strand_count(); ++s) {
      result.push_back(groom.rest_position_m[groom.offset[s] + i]);
    }
  }
  return result;
}

/// Programs are what a case costs: one of features that no other case here has is for the whole grid, if each
/// of its features is in a case with others.
bool is_on_grid(const ParityCase& test) {
  constexpr std::string_view kWholeOnly[] = {"both ends pinned", "wind", "wind and gusts", "colliders"};
  return test_grid() == TestGrid::Whole ||
         std::find(std::begin(kWholeOnly), std::end(kWholeOnly), test.name) == std::end(kWholeOnly);
}

class SolverParity : public testing::TestWithParam<std::tuple<std::string, SimDevice>> {
 protected:
  void compare(const SolverRow& row, const ParityCase& test);
  SimExecutors executors_;
};

void SolverParity::compare(const SolverRow& row, const ParityCase& test) {
  TestGroomDesc desc;
  desc.pinning = test.pinning;
  desc.vertex_count = test.vertex_count;
  desc.bend_rad = test.bend_rad;
  const Groom groom = make_test_groom(desc);
  const auto parameters = complete_parameters(row, known_parameters(row, test.parameters));
  ASSERT_TRUE(parameters);
  auto kernel = row.make(*parameters, {&executors_.on(std::get<SimDevice>(GetParam())), features_for(test)});
  ASSERT_TRUE(kernel) << kernel.error().to_string();
  const auto reference = row.make_reference(*parameters);
  const glm::dquat start = moving_input(0, kSubstepS).world_from_head_rotation;
  ASSERT_TRUE((*kernel)->load(groom, start));
  ASSERT_TRUE(reference->load(groom, start));
  SolverState from_kernel;
  SolverState expected;
  for (int step = 1; step <= test.steps; ++step) {
    const double bound_m = bound_for(row, test, step);
    (*kernel)->substep(input_for(test, step));
    reference->substep(input_for(test, step));
    (*kernel)->read(from_kernel);
    reference->read(expected);
    ASSERT_LE(largest_distance_m(from_kernel.position_m, expected.position_m), bound_m) << "step " << step;
    // A velocity is a difference of positions over the substep, twice with the correction.
    ASSERT_LE(largest_distance_m(from_kernel.velocity_mps, expected.velocity_mps), 3.0 * bound_m / kSubstepS)
        << "step " << step;
  }
  // The motion is not the rest: a kernel that does nothing would be seen.
  ASSERT_GT(largest_distance_m(from_kernel.position_m, groom_positions(groom)), 1e-3);
}

TEST_P(SolverParity, TheKernelFollowsItsReference) {
  const SolverRow& row = **find_solver(std::get<std::string>(GetParam()));
  for (const ParityCase& test : parity_cases()) {
    if (!is_on_grid(test)) continue;
    SCOPED_TRACE(test.name);
    ASSERT_NO_FATAL_FAILURE(compare(row, test));
  }
}

// What lies on neck and chest goes along with them: a reference that takes them for the head is seen.
TEST_P(SolverParity, ABustThatIsRigidIsAnother) {
  const SolverRow& row = **find_solver(std::get<std::string>(GetParam()));
  const auto of_bust = [](const ParityCase& test) { return test.has_bust; };
  const std::vector<ParityCase> cases = parity_cases();
  const ParityCase& test = *std::find_if(cases.begin(), cases.end(), of_bust);
  const Groom groom = make_test_groom({});
  const auto parameters = complete_parameters(row, known_parameters(row, test.parameters));
  ASSERT_TRUE(parameters);
  if (!parameters->contains("collider_friction")) return;  // nothing slides
  SolverState states[2];
  for (const bool is_rigid : {false, true}) {
    const auto reference = row.make_reference(*parameters);
    ASSERT_TRUE(reference->load(groom, moving_input(0, kSubstepS).world_from_head_rotation));
    for (int step = 1; step <= test.steps; ++step) {
      StepInput input = input_for(test, step);
      if (is_rigid) input.bust = {};
      reference->substep(input);
    }
    reference->read(states[is_rigid ? 1 : 0]);
  }
  EXPECT_GT(largest_distance_m(states[0].position_m, states[1].position_m),
            3.0 * bound_for(row, test, test.steps));
}

std::vector<std::string> rows_with_kernel() {
  std::vector<std::string> names;
  for (const SolverRow& row : solver_table())
    if (row.has_kernel) names.push_back(row.name);
  return names;
}

std::string case_name(const testing::TestParamInfo<SolverParity::ParamType>& info) {
  return std::get<std::string>(info.param) + "_on_" + to_string(std::get<SimDevice>(info.param));
}
INSTANTIATE_TEST_SUITE_P(EveryRow, SolverParity,
                         testing::Combine(testing::ValuesIn(rows_with_kernel()),
                                          testing::ValuesIn(sim_devices())),
                         case_name);

// A row that is meant to have a kernel must not pass by saying that it has none.
TEST(SolverTable, HasOneRowWithoutAKernel) {
  EXPECT_LE(solver_table().size() - rows_with_kernel().size(), 1u);
}

}  // namespace
}  // namespace strandcast::solver_parity_test

// What tractrix_split shows: a step by hand, the ends of its one number, and the way back to the style.
#include "server/sim/solvers/tractrix/tractrix_step.h"
#include "tests/support/solver_fixture.h"

namespace strandcast::tractrix_split_test {
namespace {

constexpr double kSubstepS = 1.0 / 60.0;

class TractrixSplit : public SolverTest {
 protected:
  static std::vector<SolverKind> kinds() { return kinds_of(**find_solver("tractrix_split")); }
  /// A moving head without wind and colliders, its groom made under gravity.
  static StepInput bare_motion(int step) {
    StepInput input = moving_input(step, kSubstepS);
    input.wind_mps = glm::dvec3(0.0);
    input.gusts.clear();
    input.colliders.clear();
    return input;
  }
  static StepInput standing() {
    StepInput input;
    input.groom_gravity_in_head_mps2 = input.gravity_mps2;
    return input;
  }
  static double mean_distance_m(const SolverState& a, const SolverState& b) {
    double sum = 0.0;
    for (size_t i = 0; i < a.position_m.size(); ++i) sum += glm::distance(a.position_m[i], b.position_m[i]);
    return sum / static_cast<double>(a.position_m.size());
  }
};

// Let go horizontally: the tip falls by g h^2 and drags the two segments; then the root is drawn back and the
// segments follow the other way round. The tip's velocity is the way that is left.
TEST_F(TractrixSplit, OneStepMatchesTheAlgorithmByHand) {
  const Groom groom = groom_from({{{0.f, 0.f, 0.f}, {1.f, 0.f, 0.f}, {2.f, 0.f, 0.f}}}, Pinning::Root);
  constexpr double kStepS = 0.1;
  const glm::dvec3 p0(0.0);
  const glm::dvec3 p1(1.0, 0.0, 0.0);
  const glm::dvec3 p2(2.0, 0.0, 0.0);
  const glm::dvec3 fallen = p2 + glm::dvec3(0.0, -10.0 * kStepS * kStepS, 0.0);
  const glm::dvec3 dragged1 = tractrix_followed(p2, fallen, p1, 1.0);
  const glm::dvec3 dragged0 = tractrix_followed(p1, dragged1, p0, 1.0);
  const glm::dvec3 back1 = tractrix_followed(dragged0, p0, dragged1, 1.0);
  const glm::dvec3 back2 = tractrix_followed(dragged1, back1, fallen, 1.0);
  for (const SolverKind& kind : kinds()) {
    SCOPED_TRACE(kind.name());
    auto solver = make(kind, groom,
                       {{"style_mix", 0.0},
                        {"style_stiffness_per_s2", 0.0},
                        {"air_drag_per_s", 0.0},
                        {"max_speed_mps", 1000.0}});
    StepInput input;
    input.h_s = kStepS;
    input.gravity_mps2 = {0.0, -10.0, 0.0};
    solver->substep(input);
    const SolverState state = read(*solver);
    EXPECT_LE(glm::distance(glm::dvec3(state.position_m[1]), back1), 5e-7);
    EXPECT_LE(glm::distance(glm::dvec3(state.position_m[2]), back2), 1e-6);
    EXPECT_LE(glm::distance(glm::dvec3(state.velocity_mps[2]), (back2 - p2) / kStepS), 1e-5);
    EXPECT_LT(back2.y, -0.09) << "nearly free: a straight strand does not hold its tip up";
  }
}

TEST_F(TractrixSplit, AllStyleIsARigidStrandAndLessStyleMovesMore) {
  const Groom groom = make_test_groom({});
  for (const SolverKind& kind : kinds()) {
    SCOPED_TRACE(kind.name());
    double last_m = 0.0;
    for (const double mix : {1.0, 0.75, 0.5, 0.25, 0.0}) {
      auto solver =
          make(kind, groom, {{"style_mix", mix}}, moving_input(0, kSubstepS).world_from_head_rotation);
      double moved_m = 0.0;
      for (int step = 1; step <= 60; ++step) {
        solver->substep(bare_motion(step));
        const SolverState state = read(*solver);
        const glm::dquat turn = bare_motion(step).world_from_head_rotation;
        const uint32_t strands = groom.strand_count();
        for (size_t i = 0; i < state.position_m.size(); ++i) {
          const glm::dvec3 rest(groom.rest_position_m[groom.offset[i % strands] + i / strands]);
          moved_m = std::fmax(moved_m, glm::distance(glm::dvec3(state.position_m[i]), turn * rest));
        }
      }
      if (mix == 1.0) {
        EXPECT_LE(moved_m, 2e-6) << "rounding over 15 segments";
      } else {
        EXPECT_GT(moved_m, 1.1 * last_m) << "mix " << mix;
      }
      last_m = moved_m;
    }
    EXPECT_GT(last_m, 0.02);
  }
}

// As published, nothing brings back what the tip has dragged away: every shape with the tip in its place is
// at rest. The return to the style takes it back.
TEST_F(TractrixSplit, TheStyleComesBackAfterMotion) {
  const Groom groom = make_test_groom({});
  for (const SolverKind& kind : kinds()) {
    SCOPED_TRACE(kind.name());
    double left_m[2] = {0.0, 0.0};
    for (const int returns : {0, 1}) {
      auto solver = make(kind, groom,
                         returns == 0 ? SolverParameters{{"style_return_per_s", 0.0}} : SolverParameters{});
      const SolverState style = read(*solver);
      for (int step = 1; step <= 120; ++step) solver->substep(bare_motion(step));
      for (int step = 0; step < 1800; ++step) solver->substep(standing());
      left_m[returns] = mean_distance_m(read(*solver), style);
    }
    EXPECT_GT(left_m[0], 1e-3);
    EXPECT_LE(left_m[1], 2e-6);
    fmt::print("{}: {:.3f} mm from the style after 30 s as published, {:.5f} with the return\n", kind.name(),
               1e3 * left_m[0], 1e3 * left_m[1]);
  }
}

}  // namespace
}  // namespace strandcast::tractrix_split_test

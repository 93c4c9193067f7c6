// What static Follow-The-Leader keeps and what it does not, against Dynamic Follow-The-Leader.
#include "tests/support/solver_fixture.h"

namespace strandcast::follow_laws_test {
namespace {

class FollowLaws : public SolverTest {
 protected:
  /// Largest distance over a second of free swing between the vertices of a strand of 4 and the first 4 of
  /// one of 12, both let go horizontally.
  double shift_by_followers_m(const SolverKind& kind) {
    const auto straight = [](int count) {
      std::vector<glm::vec3> strand;
      for (int i = 0; i < count; ++i) strand.emplace_back(0.02 * i, 0.0, 0.0);
      return groom_from({strand}, Pinning::Root);
    };
    constexpr uint32_t kShort = 4;
    const SolverParameters limp = {{"style_stiffness_per_s2", 0.0}};
    auto short_strand = make(kind, straight(kShort), limp);
    auto long_strand = make(kind, straight(12), limp);
    double largest_m = 0.0;
    for (int step = 0; step < 60; ++step) {
      short_strand->substep({});
      long_strand->substep({});
      SolverState shorter = read(*short_strand);
      SolverState longer = read(*long_strand);
      longer.position_m.resize(kShort);
      largest_m = std::fmax(largest_m, largest_distance_m(shorter.position_m, longer.position_m));
    }
    return largest_m;
  }
};

// Nothing goes from a follower to its leader: what hangs on a vertex weighs nothing to it. The dynamic form's
// velocity correction is what carries it over.
TEST_F(FollowLaws, InTheStaticFormFollowersWeighNothing) {
  for (const SolverHost& host : solver_hosts()) {
    EXPECT_EQ(shift_by_followers_m({*find_solver("ftl"), host}), 0.0);
    EXPECT_GT(shift_by_followers_m({*find_solver("dftl"), host}), 0.01);
  }
}

// Why the table says that the static form does not come to rest: the row would be wrong if it did.
TEST_F(FollowLaws, OnlyTheDynamicFormComesToRest) {
  const Groom groom = make_test_groom({});
  for (const SolverHost& host : solver_hosts()) {
    const auto moved_in_a_step_m = [&](const char* name) {
      auto solver = make({*find_solver(name), host}, groom);
      for (int step = 0; step < 600; ++step) solver->substep({});
      const SolverState before = read(*solver);
      solver->substep({});
      return largest_distance_m(read(*solver).position_m, before.position_m);
    };
    EXPECT_GT(moved_in_a_step_m("ftl"), 1e-4);
    EXPECT_LT(moved_in_a_step_m("dftl"), 1e-4);
  }
}

TEST_F(FollowLaws, StaticStepMatchesTheEquationsByHand) {
  // Let go horizontally: p1 = (1, -0.1) goes to the circle about the root, p2 to the one about the new p1;
  // the velocities are the ways over h.
  const Groom groom = groom_from({{{0.f, 0.f, 0.f}, {1.f, 0.f, 0.f}, {2.f, 0.f, 0.f}}}, Pinning::Root);
  const SolverParameters parameters = {
      {"air_drag_per_s", 0.0}, {"style_stiffness_per_s2", 0.0}, {"max_speed_mps", 1000.0}};
  constexpr double kStepS = 0.1;
  const glm::dvec3 q1 = glm::normalize(glm::dvec3(1.0, -0.1, 0.0));
  const glm::dvec3 q2 = q1 + glm::normalize(glm::dvec3(2.0, -0.1, 0.0) - q1);
  const glm::dvec3 v1 = (q1 - glm::dvec3(1.0, 0.0, 0.0)) / kStepS;
  const glm::dvec3 v2 = (q2 - glm::dvec3(2.0, 0.0, 0.0)) / kStepS;
  for (const SolverHost& host : solver_hosts()) {
    auto solver = make({*find_solver("ftl"), host}, groom, parameters);
    StepInput input;
    input.h_s = kStepS;
    input.gravity_mps2 = {0.0, -10.0, 0.0};
    solver->substep(input);
    const SolverState state = read(*solver);
    EXPECT_LE(glm::distance(glm::dvec3(state.position_m[1]), q1), 3e-7);
    EXPECT_LE(glm::distance(glm::dvec3(state.position_m[2]), q2), 6e-7);
    EXPECT_LE(glm::distance(glm::dvec3(state.velocity_mps[1]), v1), 1e-5);
    EXPECT_LE(glm::distance(glm::dvec3(state.velocity_mps[2]), v2), 1e-5);
  }
}

}  // namespace
}  // namespace strandcast::follow_laws_test

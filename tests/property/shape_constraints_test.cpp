// shape_constraints: each constraint alone does what its equation says; then what they keep together.
#include "tests/support/solver_fixture.h"

namespace strandcast::shape_constraints_test {
namespace {

class ShapeConstraints : public SolverTest {
 protected:
  static std::vector<SolverKind> kinds() { return kinds_of(**find_solver("shape_constraints")); }

  /// Everything off, to switch on one part at a time.
  static SolverParameters bare(const SolverParameters& changes) {
    SolverParameters parameters = {
        {"iterations", 0.0},      {"shape_iterations", 0.0},  {"style_stiffness_per_s2", 0.0},
        {"style_tip_share", 1.0}, {"air_drag_per_s", 0.0},    {"damping_per_s", 0.0},
        {"shock_share", 0.0},     {"max_speed_mps", 1000.0},  {"fast_acceleration_mps2", 1e9},
        {"stretch_limit", 10.0},  {"fast_damping_per_s", 0.0}};
    for (const auto& [name, value] : changes) parameters[name] = value;
    return parameters;
  }

  /// A strand along x from the head joint.
  static Groom along_x(int count, float segment_m, Pinning pinning = Pinning::Root) {
    std::vector<glm::vec3> strand;
    for (int i = 0; i < count; ++i) strand.emplace_back(segment_m * static_cast<float>(i), 0.0f, 0.0f);
    return groom_from({strand}, pinning);
  }

  static void expect_positions(Solver& solver, const std::vector<glm::dvec3>& expected_m,
                               double tolerance_m) {
    const SolverState state = read(solver);
    ASSERT_EQ(state.position_m.size(), expected_m.size());
    for (size_t i = 0; i < expected_m.size(); ++i) {
      EXPECT_LE(glm::distance(glm::dvec3(state.position_m[i]), expected_m[i]), tolerance_m) << "vertex " << i;
    }
  }

  static void put(Solver& solver, const std::vector<glm::vec3>& position_m) {
    SolverState state = read(solver);
    state.position_m = position_m;
    solver.write(state);
  }
};

// PT1 "Local constraints": a lone error is taken back by both ends, so that the middle stays. Stiffness:
// L = 0.2 m, l = 0.1 m, h = 0.1 s, b = 0.0075 m^4/s^2: 1 / (k h^2) = 3 L l^3 / (8 b h^2) = 1 segment's mass,
// so that each end takes 1 / (1 + 1 + 1) of the error, relaxed.
TEST_F(ShapeConstraints, LocalShapeTurnsASegmentAboutItsMiddle) {
  constexpr double kRelaxation = 0.7;
  const glm::dvec3 before(0.1, 0.0, 0.0);
  const glm::dvec3 tip(0.16, 0.08, 0.0);
  const glm::dvec3 error = tip - before - glm::dvec3(0.1, 0.0, 0.0);
  for (const SolverKind& kind : kinds()) {
    SCOPED_TRACE(kind.name());
    auto solver =
        make(kind, along_x(3, 0.1f), bare({{"shape_iterations", 1.0}, {"bend_stiffness_m4_per_s2", 7.5e-3}}));
    put(*solver, {{0.0f, 0.0f, 0.0f}, glm::vec3(before), glm::vec3(tip)});
    solver->substep(calm_input(0.1));
    expect_positions(*solver,
                     {{0.0, 0.0, 0.0}, before + kRelaxation * error / 3.0, tip - kRelaxation * error / 3.0},
                     3e-8);
    const SolverState state = read(*solver);
    const glm::dvec3 middle = 0.5 * (glm::dvec3(state.position_m[1]) + glm::dvec3(state.position_m[2]));
    EXPECT_LE(glm::distance(middle, 0.5 * (before + tip)), 3e-8);
  }
}

// The groomed angle is that to the segment before: a bent strand that is turned as a whole has no error but
// at the root, whose angle is that to the head. Two pinned vertices have none either.
TEST_F(ShapeConstraints, LocalShapeSeesAnglesBetweenSegmentsOnly) {
  const Groom groom = groom_from(
      {{{0.f, 0.f, 0.f}, {0.1f, 0.f, 0.f}, {0.2f, 0.05f, 0.f}, {0.2f, 0.1f, 0.09f}}}, Pinning::Root);
  const glm::dquat turn = glm::angleAxis(1.2, glm::normalize(glm::dvec3(0.2, 1.0, -0.5)));
  for (const SolverKind& kind : kinds()) {
    SCOPED_TRACE(kind.name());
    // Soft, so that nothing but the first turn shows.
    auto solver = make(kind, groom, bare({{"shape_iterations", 1.0}, {"bend_stiffness_m4_per_s2", 1e-3}}));
    std::vector<glm::vec3> turned_m;
    std::vector<glm::dvec3> expected_m;
    for (const glm::vec3& point : groom.rest_position_m) {
      turned_m.push_back(glm::vec3(turn * glm::dvec3(point)));
      expected_m.emplace_back(turned_m.back());
    }
    // Only vertex 1 has an error; all that follows keeps its angle to the segment before when it moves along.
    auto untouched =
        make(kind,
             groom_from({{{0.f, 0.f, 0.f}, {0.1f, 0.f, 0.f}, {0.2f, 0.05f, 0.f}, {0.2f, 0.1f, 0.09f}}},
                        Pinning::RootPair),
             bare({{"shape_iterations", 1.0}, {"bend_stiffness_m4_per_s2", 1e-3}}), turn);
    put(*untouched, turned_m);
    StepInput input = calm_input();
    input.world_from_head_rotation = turn;
    untouched->substep(input);
    expect_positions(*untouched, expected_m, 1e-7);
    put(*solver, turned_m);
    solver->substep(calm_input());
    EXPECT_GT(glm::distance(read(*solver).position_m[1], turned_m[1]), 1e-4f);
  }
}

// PT1 "Global constraints": x' = x + S (target - x), S = h^2 s / (1 + h^2 s), in steps of a 60th of a
// second; in others the pull is looked up elsewhere (pull_rate_test.cpp).
TEST_F(ShapeConstraints, GlobalShapeTakesItsShareOfTheWayBack) {
  constexpr double kStepS = 1.0 / 60.0;
  constexpr double kStiffnessPerS2 = 1800.0;
  const double share = kStepS * kStepS * kStiffnessPerS2 / (1.0 + kStepS * kStepS * kStiffnessPerS2);
  const glm::dvec3 displaced(0.07, -0.02, 0.03);
  const glm::dvec3 target(0.1, 0.0, 0.0);
  for (const SolverKind& kind : kinds()) {
    SCOPED_TRACE(kind.name());
    auto solver = make(kind, along_x(2, 0.1f), bare({{"style_stiffness_per_s2", kStiffnessPerS2}}));
    put(*solver, {glm::vec3(0.0f), glm::vec3(displaced)});
    solver->substep(calm_input(kStepS));
    expect_positions(*solver, {{0.0, 0.0, 0.0}, displaced + share * (target - displaced)}, 2e-8);
  }
}

// The whole strand goes along by the coefficient, in the step and, by its velocity, in the next.
TEST_F(ShapeConstraints, AShockMovesTheWholeStrandByItsShare) {
  constexpr double kShare = 0.8;
  const glm::dvec3 shift_m(0.01, 0.02, -0.03);
  for (const SolverKind& kind : kinds()) {
    SCOPED_TRACE(kind.name());
    const Groom groom = along_x(5, 0.05f);
    auto solver = make(kind, groom, bare({{"shock_share", kShare}}));
    std::vector<glm::dvec3> expected_m;
    for (const glm::vec3& point : groom.rest_position_m) expected_m.emplace_back(point);
    StepInput input = calm_input();
    input.head_shift_m = shift_m;
    for (int step = 1; step <= 3; ++step) {
      solver->substep(input);
      // Seen from the head, what it does not take along stays behind.
      for (size_t i = 1; i < expected_m.size(); ++i) expected_m[i] -= (1.0 - kShare) * shift_m;
      expect_positions(*solver, expected_m, 2e-7);
    }
    // The head stops: so does what it took along.
    input.head_shift_m = glm::dvec3(0.0);
    solver->substep(input);
    expect_positions(*solver, expected_m, 3e-7);
  }
}

// From twice the acceleration that is fast on the strand goes along rigidly, turns included.
TEST_F(ShapeConstraints, AFastShockTakesTheStrandAlongRigidly) {
  TestGroomDesc desc;
  desc.pinning = Pinning::Root;
  const Groom groom = make_test_groom(desc);
  StepInput input = calm_input();
  input.head_shift_m = {0.05, 0.0, 0.02};  // in one step: 190 m/s^2
  input.world_from_head_rotation = glm::angleAxis(0.3, glm::normalize(glm::dvec3(1.0, 2.0, 0.5)));
  for (const SolverKind& kind : kinds()) {
    SCOPED_TRACE(kind.name());
    auto solver = make(kind, groom, {{"shock_share", 0.0}, {"air_drag_per_s", 0.0}});
    solver->substep(input);
    auto turned = make(kind, groom, {}, input.world_from_head_rotation);
    EXPECT_LE(largest_distance_m(read(*solver).position_m, read(*turned).position_m), 2e-6);
  }
}

// PT1 "Edge constraints", segments after even vertices first: vertices at 0, 1.3, 2 and 3.4 m. First 0-1
// (the root does not move) and 2-3 (0.2 m each), then 1-2 (0.1 m each). Root to tip it would be 1, 2.2, 3.2.
TEST_F(ShapeConstraints, LengthsAreCorrectedInRedBlackOrder) {
  for (const SolverKind& kind : kinds()) {
    SCOPED_TRACE(kind.name());
    auto solver = make(kind, along_x(4, 1.0f), bare({{"iterations", 1.0}}));
    put(*solver, {{0.f, 0.f, 0.f}, {1.3f, 0.f, 0.f}, {2.f, 0.f, 0.f}, {3.4f, 0.f, 0.f}});
    solver->substep(calm_input());
    expect_positions(*solver, {{0, 0, 0}, {1.1, 0, 0}, {2.1, 0, 0}, {3.2, 0, 0}}, 5e-7);
    // An odd number of vertices: 0-1, 2-3, then 1-2, 3-4.
    auto longer = make(kind, along_x(5, 1.0f), bare({{"iterations", 1.0}}));
    put(*longer, {{0.f, 0.f, 0.f}, {1.3f, 0.f, 0.f}, {2.f, 0.f, 0.f}, {3.4f, 0.f, 0.f}, {4.4f, 0.f, 0.f}});
    longer->substep(calm_input());
    expect_positions(*longer, {{0, 0, 0}, {1.1, 0, 0}, {2.1, 0, 0}, {3.3, 0, 0}, {4.3, 0, 0}}, 5e-7);
  }
}

TEST_F(ShapeConstraints, LengthErrorsFallWithTheIterations) {
  const Groom groom = make_test_groom({});
  double before = 1e9;
  for (const double iterations : {1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0}) {
    auto solver = make(kinds()[0], groom, {{"iterations", iterations}, {"stretch_limit", 10.0}});
    double largest = 0.0;
    for (int step = 1; step <= 120; ++step) {
      solver->substep(moving_input(step, 1.0 / 60.0));
      largest = std::fmax(largest, largest_stretch(groom, read(*solver)));
    }
    EXPECT_LT(largest, 0.8 * before) << iterations << " iterations";
    fmt::print("{:2} length iterations, no limit: stretch {:.3f}\n", iterations, largest);
    before = largest;
  }
  EXPECT_LT(before, 0.1);
}

// Zappe, algorithm 1: the ad-hoc pass meets all lengths in one walk, however poor the convergence, and only
// while the acceleration is fast.
TEST_F(ShapeConstraints, TheFastPassLeavesExactLengths) {
  const Groom groom = make_test_groom({});
  const SolverParameters few = {{"iterations", 1.0}, {"stretch_limit", 10.0}, {"shock_share", 0.0}};
  for (const SolverKind& kind : kinds()) {
    SCOPED_TRACE(kind.name());
    auto solver = make(kind, groom, few);
    for (int step = 1; step <= 60; ++step) solver->substep(moving_input(step, 1.0 / 60.0));
    EXPECT_GT(length_excess_m(groom, read(*solver), 0.05), 0.0) << "nothing to take back";
    for (int step = 61; step <= 90; ++step) {
      StepInput input = moving_input(step, 1.0 / 60.0);
      input.head_shift_m.z += step % 2 == 0 ? 0.05 : -0.05;
      solver->substep(input);
      ASSERT_LE(length_excess_m(groom, read(*solver), 1e-5), 0.0) << "step " << step;
    }
  }
}

// The damping of that pass takes out what the pass and the jolts bring in.
TEST_F(ShapeConstraints, TheFastPassDampsWhatJoltsBringIn) {
  const Groom groom = make_test_groom({});
  double speed_mps[2] = {0.0, 0.0};
  for (const int is_damped : {0, 1}) {
    auto solver =
        make(kinds()[0], groom, {{"damping_per_s", 0.0}, {"fast_damping_per_s", is_damped ? 20.0 : 0.0}});
    StepInput input;
    for (int step = 1; step <= 60; ++step) {
      input.head_shift_m = {step % 2 == 0 ? 0.03 : -0.03, 0.0, 0.0};
      solver->substep(input);
    }
    const SolverState state = read(*solver);
    const glm::dvec3 head_mps = input.head_shift_m / input.h_s;
    for (const glm::vec3& velocity : state.velocity_mps)
      speed_mps[is_damped] = std::fmax(speed_mps[is_damped], glm::distance(glm::dvec3(velocity), head_mps));
  }
  EXPECT_LT(speed_mps[1], 0.8 * speed_mps[0]);
}

// A rate: the same in one second whatever the steps, and none of it brakes a head in uniform motion.
TEST_F(ShapeConstraints, DampingIsARate) {
  constexpr double kRatePerS = 4.8;
  for (const SolverKind& kind : kinds()) {
    for (const int rate_hz : {30, 60, 240}) {
      SCOPED_TRACE(fmt::format("{}, {} Hz", kind.name(), rate_hz));
      auto solver = make(kind, along_x(3, 0.1f), bare({{"damping_per_s", kRatePerS}}));
      SolverState state = read(*solver);
      const glm::vec3 head_mps(3.0f, 0.0f, 1.0f);
      for (glm::vec3& velocity : state.velocity_mps) velocity = head_mps;
      state.velocity_mps[2] += glm::vec3(0.0f, 0.1f, 0.0f);
      solver->write(state);
      StepInput input = calm_input(1.0 / rate_hz);
      input.head_shift_m = glm::dvec3(head_mps) / static_cast<double>(rate_hz);
      for (int step = 0; step < rate_hz; ++step) solver->substep(input);
      state = read(*solver);
      EXPECT_NEAR(state.velocity_mps[2].y, 0.1 * std::exp(-kRatePerS), 2e-5);
      EXPECT_NEAR(state.velocity_mps[1].x, head_mps.x, 2e-5);
    }
  }
}

// Air carries a strand that lies across it as the drag says, however short its segments, and one that lies
// along it by the stated share: after one step h k w / (1 + h k), with k the drag that counts.
TEST_F(ShapeConstraints, WindPushesBySecondsNotBySegments) {
  constexpr double kStepS = 0.1;
  constexpr double kDragPerS = 3.0;
  constexpr double kAlongShare = 0.5;
  constexpr double kWindMps = 0.02;
  const auto carried_mps = [](double drag) { return kStepS * drag * kWindMps / (1.0 + kStepS * drag); };
  for (const SolverKind& kind : kinds()) {
    for (const float segment_m : {0.1f, 0.001f}) {
      SCOPED_TRACE(fmt::format("{}, segments of {} m", kind.name(), segment_m));
      auto solver = make(kind, along_x(3, segment_m),
                         bare({{"air_drag_per_s", kDragPerS}, {"air_along_share", kAlongShare}}));
      StepInput input = calm_input(kStepS);
      input.wind_mps = {kWindMps, kWindMps, 0.0};
      solver->substep(input);
      const SolverState state = read(*solver);
      EXPECT_NEAR(state.velocity_mps[1].y, carried_mps(kDragPerS), 1e-6);
      EXPECT_NEAR(state.velocity_mps[1].x, carried_mps(kAlongShare * kDragPerS), 1e-6);
    }
  }
}

// The stiffness is that of a rod of this length, 1/8 w L^4 / EI for small loads, within the O(1/n) of a tip
// as heavy as the other vertices, and the same at every rate. A share per iteration would be 16 times as
// stiff at 240 Hz as at 60 Hz, and more with every iteration.
TEST_F(ShapeConstraints, DroopDoesNotDependOnVerticesRateOrIterations) {
  constexpr double kLengthM = 0.25;
  constexpr double kLoad = 0.5;           // g L^3 / b
  constexpr double kRodDroop = 0.062306;  // of the length at that load: exact solution
  const SolverKind kind = kinds()[0];
  for (const int vertex_count : {8, 16, 32}) {
    const double allowed = (1.0 + 2.0 / vertex_count) * kRodDroop;
    for (const double rate_hz : {30.0, 60.0, 240.0}) {
      for (const double iterations : {4.0, 8.0}) {
        SolverParameters parameters = kind.row->as_hair(HairConstants(), 0.0, 0.0);
        const double stiffness = parameters.at("bend_stiffness_m4_per_s2");
        parameters["shape_iterations"] = iterations;
        parameters["damping_per_s"] = 4.0;  // nearly critical
        auto solver =
            make(kind, along_x(vertex_count, static_cast<float>(kLengthM / (vertex_count - 1))), parameters);
        StepInput input;
        input.h_s = 1.0 / rate_hz;
        input.gravity_mps2 = {0.0, -kLoad * stiffness / std::pow(kLengthM, 3), 0.0};
        for (int step = 0; step < 4.0 * rate_hz; ++step) solver->substep(input);
        const double droop = -read(*solver).position_m.back().y / kLengthM;
        fmt::print("{:2} vertices, {:3} Hz, {} iterations: droop {:.4f} of the length, rod {:.4f}\n",
                   vertex_count, rate_hz, iterations, droop, kRodDroop);
        EXPECT_NEAR(droop, 0.5 * (allowed + kRodDroop), 0.5 * (allowed - kRodDroop) + 0.1 * kRodDroop);
      }
    }
  }
}

// TressFX's issue 19: with local shape on, fur flickers between two states. At rest under gravity nothing
// moves.
TEST_F(ShapeConstraints, HeldShapesDoNotFlicker) {
  constexpr double kHair = 1.44e-3;
  const struct {
    double stiffness, shape_iterations, rate_hz;
  } cases[] = {{kHair, 4, 30},  {kHair, 4, 60},     {kHair, 2, 60},  {2 * kHair, 2, 60},
               {kHair, 4, 240}, {2 * kHair, 4, 60}, {kHair, 16, 60}, {kHair, 1, 60},
               {kHair, 2, 240}, {7 * kHair, 1, 60}, {1.0, 1, 60},    {1.0, 2, 30}};
  const Groom groom = make_test_groom({});
  for (const auto& [stiffness, shape_iterations, rate_hz] : cases) {
    SCOPED_TRACE(fmt::format("{} m^4/s^2, {} iterations, {} Hz", stiffness, shape_iterations, rate_hz));
    auto solver = make(kinds()[0], groom,
                       {{"bend_stiffness_m4_per_s2", stiffness}, {"shape_iterations", shape_iterations}});
    StepInput input;
    input.h_s = 1.0 / rate_hz;
    for (int step = 0; step < 8.0 * rate_hz; ++step) solver->substep(input);
    SolverState before = read(*solver);
    for (int step = 0; step < 20; ++step) {
      solver->substep(input);
      const SolverState state = read(*solver);
      ASSERT_LE(largest_distance_m(state.position_m, before.position_m), 1e-5);
      before = state;
    }
  }
}

}  // namespace
}  // namespace strandcast::shape_constraints_test

// Laws that every row of the solver table keeps, on the GPU and in double.
#include <algorithm>
#include <array>

#include "tests/support/solver_bounds.h"
#include "tests/support/solver_fixture.h"

namespace strandcast::solver_laws_test {
namespace {

constexpr double kSubstepS = 1.0 / 60.0;
constexpr double kLengthTolerance = 1e-5;  // relative

class SolverLaws : public SolverTest {
 protected:
  static std::vector<SolverKind> sag_free_kinds();
};

TEST_F(SolverLaws, RestStaysAtRestWithoutForces) {
  const Groom groom = make_law_groom();
  const glm::dquat tilted = glm::angleAxis(0.7, glm::normalize(glm::dvec3(1.0, 2.0, -1.0)));
  for (const SolverKind& kind : all_kinds()) {
    for (const double stiffness : {0.0, 400.0}) {
      SCOPED_TRACE(kind.name());
      auto solver = make(kind, groom, {{"style_stiffness_per_s2", stiffness}}, tilted);
      const SolverState before = read(*solver);
      StepInput input = calm_input();
      input.world_from_head_rotation = tilted;
      for (int step = 0; step < 120; ++step) solver->substep(input);
      // Without a pull nothing takes back a rounding: 120 steps of 16 vertices, each off by a float step of
      // 0.5 m.
      EXPECT_LE(largest_distance_m(read(*solver).position_m, before.position_m), 120 * 16 * 3e-8);
    }
  }
}

/// Solvers with a pull to the groomed shape, which carries its weight.
std::vector<SolverKind> SolverLaws::sag_free_kinds() {
  std::vector<SolverKind> kinds;
  for (const SolverKind& kind : all_kinds()) {
    const auto& infos = kind.row->parameters;
    const bool is_known = std::any_of(infos.begin(), infos.end(), [](const SolverParameterInfo& info) {
      return info.name == "style_stiffness_per_s2";
    });
    if (is_known) kinds.push_back(kind);
  }
  EXPECT_GE(kinds.size(), 4u);
  return kinds;
}

/// Gravity that acts on an upright head as on the groom when it was made.
StepInput standing_input() {
  StepInput input;
  input.groom_gravity_in_head_mps2 = input.gravity_mps2;
  return input;
}

// At rest in the groomed shape nothing pulls and the weight is carried: the prediction is where the vertex
// is. What is left is rounding, as without gravity.
TEST_F(SolverLaws, TheGroomIsTheShapeAtRestUnderGravity) {
  const Groom groom = make_law_groom();
  for (const SolverKind& kind : sag_free_kinds()) {
    SCOPED_TRACE(kind.name());
    auto solver = make(kind, groom);
    const SolverState groomed = read(*solver);
    for (int step = 0; step < 240; ++step) solver->substep(standing_input());
    EXPECT_LE(largest_distance_m(read(*solver).position_m, groomed.position_m), 1e-5);
    auto sagging = make(kind, groom, {{"sag_free", 0.0}});
    for (int step = 0; step < 240; ++step) sagging->substep(standing_input());
    EXPECT_GT(largest_distance_m(read(*sagging).position_m, groomed.position_m), 0.01);
  }
}

TEST_F(SolverLaws, ATurnedHeadWithItsOwnGravityIsAnUprightHead) {
  const Groom groom = make_law_groom();
  const glm::dquat tilted = glm::angleAxis(2.0, glm::normalize(glm::dvec3(1.0, 2.0, -1.0)));
  StepInput input = standing_input();
  input.world_from_head_rotation = tilted;
  input.gravity_mps2 = tilted * input.gravity_mps2;
  for (const SolverKind& kind : sag_free_kinds()) {
    SCOPED_TRACE(kind.name());
    auto solver = make(kind, groom, {}, tilted);
    const SolverState groomed = read(*solver);
    for (int step = 0; step < 240; ++step) solver->substep(input);
    EXPECT_LE(largest_distance_m(read(*solver).position_m, groomed.position_m), 2e-5);
  }
}

// A head on its side: what carried the weight now pushes up along the head's axis, and hair falls to the
// side.
TEST_F(SolverLaws, HairFallsToTheSideOfATiltedHead) {
  const Groom groom = make_law_groom();
  const glm::dquat on_its_side = glm::angleAxis(1.57, glm::dvec3(0.0, 0.0, 1.0));
  StepInput input = standing_input();
  input.world_from_head_rotation = on_its_side;
  for (const SolverKind& kind : sag_free_kinds()) {
    SCOPED_TRACE(kind.name());
    auto solver = make(kind, groom, {}, on_its_side);
    const SolverState groomed = read(*solver);
    for (int step = 0; step < 240; ++step) solver->substep(input);
    const SolverState state = read(*solver);
    double fallen_m = 0.0;
    const uint32_t strand_count = groom.strand_count();
    for (size_t tip = state.position_m.size() - strand_count; tip < state.position_m.size(); ++tip)
      fallen_m += (groomed.position_m[tip].y - state.position_m[tip].y) / strand_count;
    EXPECT_GT(fallen_m, 0.02) << "mean fall of the tips of strands of 0.17 to 0.25 m";
  }
}

TEST_F(SolverLaws, NothingCarriesALimpStrand) {
  const Groom groom = make_law_groom();
  for (const SolverKind& kind : sag_free_kinds()) {
    SCOPED_TRACE(kind.name());
    auto solver = make(kind, groom, {{"style_stiffness_per_s2", 0.0}, {"sag_free", 1.0}});
    auto sagging = make(kind, groom, {{"style_stiffness_per_s2", 0.0}, {"sag_free", 0.0}});
    for (int step = 0; step < 30; ++step) {
      solver->substep(standing_input());
      sagging->substep(standing_input());
    }
    EXPECT_EQ(read(*solver).position_m, read(*sagging).position_m);
  }
}

TEST_F(SolverLaws, LengthsAreExactAfterEveryStep) {
  // A taut strand that is held at both ends takes up the rounding of what is left of its reach, which 15
  // segments of 0.25 m in all are taken from.
  constexpr double kReachRoundingM = 15 * 1.5e-8;
  for (const Pinning pinning : {Pinning::Root, Pinning::RootPair, Pinning::BothEnds}) {
    const double allowed_m = pinning == Pinning::BothEnds ? kReachRoundingM : 0.0;
    TestGroomDesc desc;
    desc.pinning = pinning;
    const Groom groom = make_law_groom(desc);
    for (const SolverKind& kind : all_kinds()) {
      // Iterated odd and even placement of a strand held at both ends leaves a rest, which the next test
      // bounds.
      if (pinning == Pinning::BothEnds && !bounds_of(*kind.row).has_exact_held_length) continue;
      if (kind.row->stretch_bound > 0.0) continue;  // bounded below
      SCOPED_TRACE(kind.name());
      auto solver = make(kind, groom);
      for (int step = 1; step <= 60; ++step) {
        solver->substep(moving_input(step, kSubstepS));
        ASSERT_LE(length_excess_m(groom, read(*solver), kLengthTolerance), allowed_m) << "step " << step;
      }
    }
  }
}

// A kernel has the code of the features it was made for and of no others: what a scene lacks costs nothing.
TEST_F(SolverLaws, WhatASceneLacksIsNotInItsKernel) {
  const Groom groom = make_test_groom({});
  for (const SolverKind& kind : all_kinds()) {
    if (!kind.host.is_kernel()) continue;
    SCOPED_TRACE(kind.name());
    SceneFeatures features;
    features.has_wind = true;
    auto given_all = make(kind, groom, {}, {1.0, 0.0, 0.0, 0.0}, features);
    auto given_less = make(kind, groom, {}, {1.0, 0.0, 0.0, 0.0}, features);
    for (int step = 1; step <= 10; ++step) {
      StepInput input = moving_input(step, kSubstepS);
      given_all->substep(input);
      input.gusts.clear();
      input.colliders.clear();
      given_less->substep(input);
    }
    EXPECT_EQ(read(*given_all).position_m, read(*given_less).position_m);
  }
}

TEST_F(SolverLaws, StretchStaysWithinTheRowsBound) {
  const Groom groom = make_law_groom();
  for (const SolverKind& kind : all_kinds()) {
    if (kind.row->stretch_bound == 0.0) continue;  // exact: the law above
    SCOPED_TRACE(kind.name());
    auto solver = make(kind, groom);
    double largest = 0.0;
    for (int step = 1; step <= 240; ++step) {
      solver->substep(moving_input(step, kSubstepS));
      largest = std::max(largest, largest_stretch(groom, read(*solver)));
    }
    EXPECT_LE(largest, kind.row->stretch_bound);
    // A bound far above what happens says nothing.
    EXPECT_GE(largest, 0.3 * kind.row->stretch_bound);
    fmt::print("{}: stretch {:.4f} of {:.4f}\n", kind.name(), largest, kind.row->stretch_bound);
  }
}

TEST_F(SolverLaws, TurnedInputsGiveTheTurnedMotion) {
  const Groom groom = make_law_groom();
  const glm::dquat turn = glm::angleAxis(2.1, glm::normalize(glm::dvec3(0.3, -1.0, 0.5)));
  for (const SolverKind& kind : all_kinds()) {
    SCOPED_TRACE(kind.name());
    const glm::dquat start = moving_input(0, kSubstepS).world_from_head_rotation;
    auto solver = make(kind, groom, {}, start);
    auto other = make(kind, groom, {}, turn * start);
    for (int step = 1; step <= 10; ++step) {
      solver->substep(moving_input(step, kSubstepS));
      other->substep(turned(moving_input(step, kSubstepS), turn));
    }
    SolverState expected = read(*solver);
    for (glm::vec3& point : expected.position_m) point = glm::vec3(turn * glm::dvec3(point));
    const double growth = bounds_of(*kind.row).rounding_growth;
    EXPECT_LE(largest_distance_m(read(*other).position_m, expected.position_m), growth * growth * 1e-4);
  }
}

TEST_F(SolverLaws, AHeadInUniformMotionIsAHeadAtRest) {
  const Groom groom = make_law_groom();
  const glm::dvec3 cruise_mps(13.0, -4.0, 22.0);
  for (const SolverKind& kind : all_kinds()) {
    SCOPED_TRACE(kind.name());
    auto solver = make(kind, groom);
    auto cruising = make(kind, groom);
    SolverState state = read(*cruising);
    for (glm::vec3& velocity : state.velocity_mps) velocity += glm::vec3(cruise_mps);
    cruising->write(state);
    for (int step = 1; step <= 10; ++step) {
      StepInput input = moving_input(step, kSubstepS);
      input.gusts.clear();
      solver->substep(input);
      input.head_shift_m += cruise_mps * kSubstepS;
      input.wind_mps += cruise_mps;
      cruising->substep(input);
    }
    // Velocities of 26 m/s are stored to 1e-6 m/s.
    const double growth = bounds_of(*kind.row).rounding_growth;
    EXPECT_LE(largest_distance_m(read(*cruising).position_m, read(*solver).position_m),
              growth * growth * 1e-4);
  }
}

TEST_F(SolverLaws, TheOrderOfStrandsChangesNoBit) {
  const Groom groom = make_test_groom({});
  const uint32_t strand_count = groom.strand_count();
  std::vector<std::vector<glm::vec3>> strands;
  for (uint32_t s = 0; s < strand_count; ++s) {
    const uint32_t source = (s * 8 + 3) % strand_count;  // 8 and 21 share no factor: a permutation
    const auto begin = groom.rest_position_m.begin() + groom.offset[source];
    strands.emplace_back(begin, begin + groom.vertex_count(source));
  }
  const Groom shuffled = groom_from(strands, Pinning::RootPair);
  for (const SolverKind& kind : all_kinds()) {
    SCOPED_TRACE(kind.name());
    auto solver = make(kind, groom);
    auto other = make(kind, shuffled);
    for (int step = 1; step <= 10; ++step) {
      solver->substep(moving_input(step, kSubstepS));
      other->substep(moving_input(step, kSubstepS));
    }
    const SolverState expected = read(*solver);
    const SolverState state = read(*other);
    for (uint32_t i = 0; i < groom.vertex_count(0); ++i) {
      for (uint32_t s = 0; s < strand_count; ++s) {
        const uint32_t source = (s * 8 + 3) % strand_count;
        ASSERT_EQ(state.position_m[i * strand_count + s], expected.position_m[i * strand_count + source]);
        ASSERT_EQ(state.velocity_mps[i * strand_count + s], expected.velocity_mps[i * strand_count + source]);
      }
    }
  }
}

/// Some tips are tied and others free: each strand moves as in a groom of its own kind, to the bit.
TEST_F(SolverLaws, StrandsOfBothKindsOfTipsMoveAsAmongTheirOwn) {
  const std::array<Groom, 2> alike = {make_law_groom(), make_law_groom({.pinning = Pinning::BothEnds})};
  Groom mixed = alike[0];
  const auto kind_of = [](uint32_t strand) { return strand % 3 == 1 ? 1u : 0u; };
  for (uint32_t s = 0; s < mixed.strand_count(); ++s)
    std::copy_n(alike[kind_of(s)].pinned.begin() + mixed.offset[s], mixed.vertex_count(s),
                mixed.pinned.begin() + mixed.offset[s]);
  SceneFeatures features = all_features();
  features.has_follicle_limit = features.has_oriented_drag = true;
  for (const SolverKind& kind : kinds_of_long_tests()) {
    SCOPED_TRACE(kind.name());
    const auto moved = [&](const Groom& groom) {
      auto solver = make(kind, groom, {}, {1.0, 0.0, 0.0, 0.0}, features);
      for (int step = 1; step <= 12; ++step) {
        StepInput input = moving_input(step, kSubstepS);
        input.follicle_limit_rad = 0.1;
        solver->substep(input);
      }
      return read(*solver);
    };
    const SolverState state = moved(mixed);
    const std::array<SolverState, 2> expected = {moved(alike[0]), moved(alike[1])};
    EXPECT_GT(largest_distance_m(expected[0].position_m, expected[1].position_m), 0.01);
    for (size_t at = 0; at < state.position_m.size(); ++at) {
      const auto strand = static_cast<uint32_t>(at % mixed.strand_count());
      ASSERT_EQ(state.position_m[at], expected[kind_of(strand)].position_m[at]) << strand;
      ASSERT_EQ(state.velocity_mps[at], expected[kind_of(strand)].velocity_mps[at]) << strand;
    }
  }
}

TEST_F(SolverLaws, TheSameInputsGiveTheSameBits) {
  const Groom groom = make_test_groom({});
  for (const SolverKind& kind : all_kinds()) {
    SCOPED_TRACE(kind.name());
    auto solver = make(kind, groom);
    auto other = make(kind, groom);
    for (int step = 1; step <= 30; ++step) {
      solver->substep(moving_input(step, kSubstepS));
      other->substep(moving_input(step, kSubstepS));
    }
    EXPECT_EQ(read(*solver).position_m, read(*other).position_m);
    EXPECT_EQ(read(*solver).velocity_mps, read(*other).velocity_mps);
  }
}

TEST_F(SolverLaws, WriteThenReadGivesTheStateBack) {
  const Groom groom = make_test_groom({});
  for (const SolverKind& kind : all_kinds()) {
    SCOPED_TRACE(kind.name());
    auto solver = make(kind, groom);
    for (int step = 1; step <= 5; ++step) solver->substep(moving_input(step, kSubstepS));
    const SolverState state = read(*solver);
    for (int step = 6; step <= 9; ++step) solver->substep(moving_input(step, kSubstepS));
    solver->write(state);
    EXPECT_EQ(read(*solver).position_m, state.position_m);
    EXPECT_EQ(read(*solver).velocity_mps, state.velocity_mps);
  }
}

TEST_F(SolverLaws, StrandsStayOutsideACollider) {
  const Groom groom = make_law_groom();
  const uint32_t strand_count = groom.strand_count();
  for (const SolverKind& kind : all_kinds()) {
    SCOPED_TRACE(kind.name());
    // Limp strands hang onto the sphere.
    auto solver = make(kind, groom, {{"style_stiffness_per_s2", 0.0}, {"style_mix", 0.0}});
    const double tolerance_m = bounds_of(*kind.row).collider_depth_m;
    size_t touching = 0;
    // Where only the tip has weight, strands take longer to come down.
    for (int step = 1; step <= 60 || (touching <= 100u && step <= 300); ++step) {
      StepInput input = moving_input(step, kSubstepS);
      input.colliders = {{glm::vec3(0.0f), 0.099f}};
      solver->substep(input);
      const SolverState state = read(*solver);
      for (size_t i = 2 * strand_count; i < state.position_m.size(); ++i) {
        const double outside_m = glm::length(glm::dvec3(state.position_m[i])) - input.colliders[0].radius_m;
        ASSERT_GE(outside_m, -tolerance_m) << "vertex " << i / strand_count << ", step " << step;
        if (outside_m < tolerance_m) ++touching;
      }
    }
    EXPECT_GT(touching, 100u) << "nothing touched the collider: the test shows nothing";
  }
}

TEST_F(SolverLaws, FrictionHoldsAStrandOnACollider) {
  // A strand lies along the top of a sphere and slides off unless friction holds it.
  std::vector<glm::vec3> strand;
  for (int i = 0; i < 8; ++i) {
    const double angle = 0.05 + 0.06 * i;
    strand.emplace_back(0.2 * std::sin(angle), 0.2 * std::cos(angle), 0.0);
  }
  const Groom groom = groom_from({strand}, Pinning::Root);
  for (const SolverKind& kind : all_kinds()) {
    SCOPED_TRACE(kind.name());
    double slid_m[2] = {0.0, 0.0};
    for (const int is_rough : {0, 1}) {
      auto solver = make(kind, groom,
                         {{"style_stiffness_per_s2", 0.0},
                          {"young_modulus_pa", 0.0},
                          {"bend_stiffness_nm_per_rad", 0.0},
                          {"bend_stiffness_m4_per_s2", 0.0},
                          {"collider_friction", is_rough ? 2.0 : 0.0}});
      StepInput input;
      input.gravity_mps2 = {0.0, -9.81, 4.0};  // pulls sideways, across the strand
      input.colliders = {{glm::vec3(0.0f), 0.2f}};
      const SolverState before = read(*solver);
      for (int step = 0; step < 30; ++step) solver->substep(input);
      slid_m[is_rough] = glm::distance(read(*solver).position_m.back(), before.position_m.back());
    }
    // mu = 2 holds what tan(slope) = 4 / 9.81 < 2 pulls.
    EXPECT_GT(slid_m[0], 0.02);
    EXPECT_LT(slid_m[1], 0.1 * slid_m[0]);
  }
}

// What the kernel is compiled without must not matter when the scene has none of it, but for the roundings of
// another compilation over ten steps: 1e-5 m, as between a kernel and its reference.
TEST_F(SolverLaws, VariantsWithoutAFeatureMatchTheFeatureAtZero) {
  const Groom groom = make_test_groom({});
  for (const SolverKind& kind : all_kinds()) {
    if (!kind.host.is_kernel()) continue;
    SCOPED_TRACE(kind.name());
    auto bare = make(kind, groom, {}, {1.0, 0.0, 0.0, 0.0}, SceneFeatures{});
    auto full = make(kind, groom);
    for (int step = 1; step <= 10; ++step) {
      StepInput input = moving_input(step, kSubstepS);
      input.gusts.clear();
      input.colliders.clear();
      bare->substep(input);
      full->substep(input);
    }
    EXPECT_LE(largest_distance_m(read(*bare).position_m, read(*full).position_m), 1e-5);
  }
}

TEST_F(SolverLaws, TheSettledShapeDoesNotDependOnTheSubstep) {
  const Groom groom = make_law_groom();
  for (const SolverKind& kind : all_kinds()) {
    if (kind.host.is_kernel() || !kind.row->comes_to_rest) continue;  // parity covers the kernels
    SCOPED_TRACE(kind.name());
    SolverState settled[2];
    const double substeps_s[2] = {1.0 / 60.0, 1.0 / on_grid(120, 240)};
    for (int i = 0; i < 2; ++i) {
      // Limp enough to hang: a strand that stands has two shapes to settle to.
      auto solver = make(kind, groom, {{"air_drag_per_s", 4.0}, {"style_stiffness_per_s2", 60.0}});
      StepInput input;
      input.h_s = substeps_s[i];
      for (int step = 0; step < 10.0 / substeps_s[i]; ++step) solver->substep(input);
      settled[i] = read(*solver);
    }
    EXPECT_LE(largest_distance_m(settled[0].position_m, settled[1].position_m),
              bounds_of(*kind.row).settled_spread_m);
  }
}

TEST_F(SolverLaws, SettledStrandsDoNotJitter) {
  const Groom groom = make_law_groom();
  for (const SolverKind& kind : all_kinds()) {
    if (!kind.row->comes_to_rest) continue;
    SCOPED_TRACE(kind.name());
    auto solver = make(kind, groom);
    const StepInput input;
    for (int step = 0; step < 600; ++step) solver->substep(input);
    SolverState before = read(*solver);
    for (int step = 0; step < 30; ++step) {
      solver->substep(input);
      const SolverState state = read(*solver);
      ASSERT_LE(largest_distance_m(state.position_m, before.position_m), 1e-4);
      before = state;
    }
  }
}

TEST_F(SolverLaws, SerialStepMatchesTheEquationsByHand) {
  // Three vertices in a row, 1 m apart, let go horizontally: h = 0.1 s, g = 10 m/s^2, no drag, no pull.
  const Groom groom = groom_from({{{0.f, 0.f, 0.f}, {1.f, 0.f, 0.f}, {2.f, 0.f, 0.f}}}, Pinning::Root);
  const SolverParameters parameters = {{"s_damping", 0.9},
                                       {"air_drag_per_s", 0.0},
                                       {"style_stiffness_per_s2", 0.0},
                                       {"max_speed_mps", 1000.0}};
  // p1 = (1, -0.1), pulled back to 1 m from the root; p2 = (2, -0.1), pulled to 1 m from there.
  const double norm = std::sqrt(1.01);
  const glm::dvec3 q1(1.0 / norm, -0.1 / norm, 0.0);
  const glm::dvec3 p2(2.0, -0.1, 0.0);
  const glm::dvec3 q2 = q1 + (p2 - q1) / glm::length(p2 - q1);
  const glm::dvec3 v1 = (q1 - glm::dvec3(1.0, 0.0, 0.0)) / 0.1 - 0.9 * (q2 - p2) / 0.1;
  const glm::dvec3 v2 = (q2 - glm::dvec3(2.0, 0.0, 0.0)) / 0.1;
  for (const SolverKind& kind : all_kinds()) {
    if (kind.row->name != "dftl") continue;
    SCOPED_TRACE(kind.name());
    auto solver = make(kind, groom, parameters);
    StepInput input;
    input.h_s = 0.1;
    input.gravity_mps2 = {0.0, -10.0, 0.0};
    solver->substep(input);
    const SolverState state = read(*solver);
    EXPECT_LE(glm::distance(glm::dvec3(state.position_m[1]), q1), 3e-7);
    EXPECT_LE(glm::distance(glm::dvec3(state.position_m[2]), q2), 6e-7);
    EXPECT_LE(glm::distance(glm::dvec3(state.velocity_mps[1]), v1), 2e-5);
    EXPECT_LE(glm::distance(glm::dvec3(state.velocity_mps[2]), v2), 2e-5);
  }
}

/// How odd-even iterations differ from the serial solver over two seconds of motion.
struct OddEvenError {
  double stretch_m = 0.0;  // largest error of a segment's length
  double largest_m = 0.0;  // largest distance of a vertex
  double mean_m = 0.0;     // mean distance of all vertices in all steps
};

class OddEven : public SolverTest {
 protected:
  OddEvenError compare(const SolverHost& host, double iterations, bool has_exact_length) {
    constexpr int kSteps = 120;
    const Groom groom = make_test_groom({});
    const SolverKind odd_even{*find_solver("dftl_parallel"), host};
    auto solver =
        make(odd_even, groom, {{"iterations", iterations}, {"exact_length", has_exact_length ? 1.0 : 0.0}});
    auto serial = make({*find_solver("dftl"), host}, groom);
    OddEvenError error;
    for (int step = 1; step <= kSteps; ++step) {
      solver->substep(moving_input(step, kSubstepS));
      serial->substep(moving_input(step, kSubstepS));
      const SolverState state = read(*solver);
      const SolverState expected = read(*serial);
      error.stretch_m = std::max(error.stretch_m, length_excess_m(groom, state, 0.0));
      error.largest_m = std::max(error.largest_m, largest_distance_m(state.position_m, expected.position_m));
      for (size_t i = 0; i < state.position_m.size(); ++i) {
        error.mean_m += glm::distance(state.position_m[i], expected.position_m[i]) /
                        static_cast<double>(kSteps * state.position_m.size());
      }
    }
    return error;
  }
};

TEST_F(OddEven, HalfAsManyIterationsAsVerticesGiveTheSerialMotion) {
  // Not a bit differs: every vertex is placed by the same arithmetic, once its leader is final.
  for (const SolverHost& host : kernel_hosts())
    EXPECT_EQ(compare(host, 8.0, false).largest_m, 0.0) << host.name();
}

// Woodhouse 2017, 4.2.3: as few as five iterations look like the serial version. Strands here are 0.17 to
// 0.25 m long and move as fast as a person can shake a head.
TEST_F(OddEven, FiveIterationsComeClose) {
  for (const SolverHost& host : kernel_hosts()) {
    SCOPED_TRACE(host.name());
    const OddEvenError iterated = compare(host, 5.0, false);
    EXPECT_LE(iterated.mean_m, 0.0025);
    EXPECT_LE(iterated.stretch_m, 0.25 / 15);  // one segment
    const OddEvenError finished = compare(host, 5.0, true);
    EXPECT_LE(finished.mean_m, 0.0025);  // a hundredth of a strand
    EXPECT_LE(finished.stretch_m, kLengthTolerance * 0.25);
    EXPECT_GT(compare(host, 2.0, true).mean_m, 2.0 * finished.mean_m) << "iterations do nothing";
    fmt::print("five iterations: mean {:.6f} m, largest {:.4f} m, stretch before the finish {:.4f} m\n",
               finished.mean_m, finished.largest_m, iterated.stretch_m);
  }
}

}  // namespace
}  // namespace strandcast::solver_laws_test

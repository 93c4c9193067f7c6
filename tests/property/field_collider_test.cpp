// Laws of strands that meet the head as a distance field, for every row of the solver table that has a kernel
// and on every executor: parity with the law in double, lengths, how deep strands end, that nothing pops,
// friction.
#include "server/sim/field_collider.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "common/base/quantile.h"
#include "common/kernels/lane_program.h"
#include "common/math/pose.h"
#include "server/sim/executor/lanes_executor.h"
#include "server/sim/reference_field.h"
#include "tests/support/meshes.h"
#include "tests/support/own_workers.h"
#include "tests/support/solver_bounds.h"
#include "tests/support/solver_fixture.h"

namespace strandcast::field_collider_test {
namespace {

constexpr double kRadiusM = 0.095;
constexpr double kSubstepS = 1.0 / 60.0;
constexpr double kFriction = 0.3;

const DistanceField& ball() {
  static const DistanceField field =
      make_distance_field(make_icosphere(static_cast<float>(kRadiusM), 4), 48).value();
  return field;
}

struct Hair {
  uint32_t strand_count = 70;
  uint32_t vertex_count = 9;
  double segment_m = 0.012;
  double root_depth_m = 0.0;  // below the skin
  double lift = 0.3;          // of a segment, as groomed: out of the tangent plane
};

/// Strands all over the ball that grow along it.
Groom make_hair(const Hair& hair) {
  std::mt19937 random(11);
  std::normal_distribution<double> any(0.0, 1.0);
  Groom groom;
  groom.name = "ball";
  groom.offset = {0};
  for (uint32_t s = 0; s < hair.strand_count; ++s) {
    const glm::dvec3 out = glm::normalize(glm::dvec3(any(random), any(random), any(random)));
    glm::dvec3 point = (kRadiusM - hair.root_depth_m) * out;
    const glm::dvec3 along = glm::dvec3(any(random), any(random), any(random));
    for (uint32_t i = 0; i < hair.vertex_count; ++i) {
      groom.rest_position_m.emplace_back(point);
      groom.pinned.push_back(i == 0 ? 1 : 0);
      const glm::dvec3 up = glm::normalize(point);
      const glm::dvec3 flat = glm::normalize(along - glm::dot(along, up) * up);
      point += hair.segment_m * glm::normalize(flat + hair.lift * up);
    }
    groom.offset.push_back(static_cast<uint32_t>(groom.rest_position_m.size()));
  }
  return groom;
}

/// Strands turned segment by segment, by angles around this, so that many lie inside.
SolverState disturbed(const Groom& groom, const StrandLayout& layout, const glm::dquat& rotation,
                      double angle_rad) {
  std::mt19937 random(5);
  std::normal_distribution<double> any(0.0, 1.0);
  SolverState state;
  state.position_m.resize(layout.size());
  state.velocity_mps.resize(layout.size());
  for (uint32_t s = 0; s < layout.strand_count; ++s) {
    const glm::vec3* rest = groom.rest_position_m.data() + groom.offset[s];
    glm::dvec3 point = rest[0];
    const glm::dvec3 axis = glm::normalize(glm::dvec3(any(random), any(random), any(random)));
    const glm::dquat bend = glm::angleAxis(angle_rad * any(random), axis);
    for (uint32_t i = 0; i < layout.vertex_count; ++i) {
      if (i > 0) point += bend * (glm::dvec3(rest[i]) - glm::dvec3(rest[i - 1]));
      state.position_m[layout.index(i, s)] = glm::vec3(rotation * point);
      state.velocity_mps[layout.index(i, s)] = glm::vec3(any(random), any(random), any(random));
    }
  }
  return state;
}

/// One run of the pass over strands that somebody put somewhere.
struct PassRun {
  StrandLayout layout;
  SolverState before, after;
  std::vector<glm::vec4> way, axis, velocity;  // after; (vertex_count x strand_count)
};
const glm::dquat kTurned = glm::angleAxis(0.7, glm::normalize(glm::dvec3(1.0, 2.0, -0.5)));

/// Neck and chest of a ball: its lower half.
BustInput turned_bust() {
  BustInput bust;
  bust.rig = {glm::vec3(0.01f, 0.02f, 0.0f), glm::vec4(0.0f, 12.0f, 3.0f, 0.6f)};
  bust.turn = {0.12, 0.2, -0.05};
  bust.turn_before = {0.1, 0.17, -0.02};
  return bust;
}

PassRun run_pass(Executor& executor, const Groom& groom, double angle_rad, double friction = kFriction,
                 const BustInput& bust = {}) {
  PassRun run;
  StrandState strands(executor);
  EXPECT_TRUE(strands.load(groom, kTurned));
  run.layout = strands.layout();
  std::vector<glm::vec4> filled(run.layout.size(), glm::vec4(0.001f, 0.002f, 0.003f, 4.0f));
  const auto way = executor.make_plane("way", run.layout.strand_count, filled);
  // Axes across the segments.
  run.before = disturbed(groom, run.layout, kTurned, angle_rad);
  for (uint32_t s = 0; s < run.layout.strand_count; ++s)
    for (uint32_t i = 1; i < run.layout.vertex_count; ++i) {
      const glm::dvec3 edge = glm::dvec3(run.before.position_m[run.layout.index(i, s)]) -
                              glm::dvec3(run.before.position_m[run.layout.index(i - 1, s)]);
      const glm::dvec3 across = glm::normalize(glm::cross(edge, glm::dvec3(0.3, 1.0, 0.7)));
      filled[run.layout.index(i, s)] = glm::vec4(glm::vec3(across), 0.25f);
    }
  const auto axis = executor.make_plane("axis", run.layout.strand_count, filled);
  const CarriedPlanes carried{way.get(), axis.get()};
  auto collider = FieldCollider::make(executor, {}, strands, carried, ball());
  EXPECT_TRUE(collider) << collider.error().to_string();
  strands.write(run.before);
  strands.write_model(std::vector<float>(run.layout.size(), 3.5f));
  StepInput input = calm_input(kSubstepS);
  input.world_from_head_rotation = kTurned;
  input.bust = bust;
  StrandParameters parameters;
  parameters.collider_friction = friction;
  const StepBlock block = make_step_block(input, parameters, run.layout.counts(), strands.head());
  collider->run(block, strands.planes(), carried);
  strands.read(run.after);
  way->read(run.way);
  axis->read(run.axis);
  BoundPlanes planes = strands.planes();
  plane_of(planes, PlaneRole::Velocity)->read(run.velocity);
  return run;
}

class FieldOnEveryExecutor : public testing::TestWithParam<SimDevice> {
 protected:
  SimExecutors executors_;
  Executor& executor_ = executors_.on(GetParam());
};

TEST_P(FieldOnEveryExecutor, DoesWhatTheLawSaysInDouble) {
  const Groom groom = make_hair({.strand_count = 500});
  const PassRun run = run_pass(executor_, groom, 0.8);
  const StrandLayout& layout = run.layout;
  const glm::dquat head_from_world = glm::conjugate(kTurned);
  size_t moved_count = 0;
  std::vector<double> errors_m;
  for (uint32_t s = 0; s < layout.strand_count; ++s) {
    std::vector<glm::dvec3> groomed, placed;
    for (uint32_t i = 0; i < layout.vertex_count; ++i) {
      groomed.emplace_back(layout.rest[layout.index(i, s)]);
      placed.push_back(head_from_world * glm::dvec3(run.before.position_m[layout.index(i, s)]));
    }
    std::vector<glm::dvec3> expected = placed;
    keep_out_of(ball(), {groomed, groomed, layout.pinned_root_count, kFriction, expected});
    for (uint32_t i = 0; i < layout.vertex_count; ++i) {
      const size_t at = layout.index(i, s);
      const glm::dvec3 now(run.after.position_m[at]), then(run.before.position_m[at]);
      errors_m.push_back(glm::distance(now, kTurned * expected[i]));
      const glm::dvec3 way = now - then;
      moved_count += glm::length(way) > 1e-6 ? 1 : 0;
      const glm::dvec3 gained =
          glm::dvec3(run.after.velocity_mps[at]) - glm::dvec3(run.before.velocity_mps[at]);
      ASSERT_LE(glm::distance(gained, way / kSubstepS), 1e-5) << "an impulse";
      ASSERT_LE(glm::distance(glm::dvec3(run.way[at]), glm::dvec3(0.001, 0.002, 0.003) + way), 1e-7);
      ASSERT_EQ(run.way[at].w, 4.0f);
      if (i == 0) continue;
      const glm::dvec3 edge = now - glm::dvec3(run.after.position_m[layout.index(i - 1, s)]);
      ASSERT_LE(std::abs(glm::dot(glm::normalize(edge), glm::dvec3(run.axis[at]))), 1e-4) << "across";
      ASSERT_NEAR(glm::length(glm::dvec3(run.axis[at])), 1.0, 1e-6);
      ASSERT_EQ(run.axis[at].w, 0.25f);
    }
  }
  EXPECT_GT(moved_count, layout.size() / 6) << "the strands do meet the ball";
  // Slopes change from cell to cell, so a rounding at their border may show: seldom, and by less than strands
  // are deep.
  EXPECT_LE(quantile(errors_m, 0.99), 2e-6);
  EXPECT_LE(*std::max_element(errors_m.begin(), errors_m.end()), 3e-3);
}

/// Of a pass under a turned bust against the law for this one: how far this share of vertices is off at most.
double error_m(const PassRun& run, const BustInput& bust, double share = 0.99) {
  const StrandLayout& layout = run.layout;
  std::vector<double> errors_m;
  for (uint32_t s = 0; s < layout.strand_count; ++s) {
    std::vector<glm::dvec3> groomed, expected;
    for (uint32_t i = 0; i < layout.vertex_count; ++i) {
      groomed.emplace_back(layout.rest[layout.index(i, s)]);
      expected.push_back(glm::conjugate(kTurned) * glm::dvec3(run.before.position_m[layout.index(i, s)]));
    }
    keep_out_of(ball(), {groomed, groomed, layout.pinned_root_count, kFriction, expected, bust});
    for (uint32_t i = 0; i < layout.vertex_count; ++i)
      errors_m.push_back(
          glm::distance(glm::dvec3(run.after.position_m[layout.index(i, s)]), kTurned * expected[i]));
  }
  return quantile(errors_m, share);
}

TEST_P(FieldOnEveryExecutor, ABustIsWhereTheLawInDoubleHasIt) {
  const PassRun run = run_pass(executor_, make_hair({.strand_count = 500}), 0.8, kFriction, turned_bust());
  EXPECT_LE(error_m(run, turned_bust()), 2e-5);
  EXPECT_GT(error_m(run, {}), 2e-3) << "a rigid bust";
  BustInput still = turned_bust();
  still.turn_before = still.turn;
  EXPECT_GT(error_m(run, still), 2e-4) << "a skin that nothing is carried along with";
}

// Where a neck bends, distances change faster than in a rigid head: whoever passes a vertex over by the way
// to the skin alone leaves it 3 mm off the law here.
TEST_P(FieldOnEveryExecutor, NoVertexIsPassedOverWhereTheNeckBends) {
  BustInput bent = turned_bust();
  bent.turn = bent.turn_before = {0.0, 0.0, 0.4};
  const PassRun run =
      run_pass(executor_, make_hair({.strand_count = 2000, .vertex_count = 12}), 0.8, kFriction, bent);
  EXPECT_LE(error_m(run, bent, 1.0), 2e-4);
  EXPECT_GT(error_m(run, turned_bust(), 1.0), 2e-3) << "another bust";
}

TEST_P(FieldOnEveryExecutor, KeepsLengthsAndWhatModelsKeepBesideVelocities) {
  const Groom groom = make_hair({});
  const PassRun run = run_pass(executor_, groom, 1.2);
  EXPECT_LE(length_excess_m(groom, run.after, 2e-6), 0.0);
  for (const glm::vec4& velocity : run.velocity) ASSERT_EQ(velocity.w, 3.5f);
}

TEST_P(FieldOnEveryExecutor, WhatTouchesNothingIsNotWrittenNorWhatBeginsInside) {
  // Groomed from 3 mm below the skin, out of it: as loaded nothing moves, not by a bit.
  const Groom groom = make_hair({.root_depth_m = 0.003});
  const PassRun run = run_pass(executor_, groom, 0.0);
  double deepest_m = 0.0;
  for (const glm::vec3& point : groom.rest_position_m)
    deepest_m = std::min(deepest_m, ball().sample(point).distance_m);
  EXPECT_LT(deepest_m, -0.002) << "a groom that begins inside";
  EXPECT_EQ(run.after.position_m, run.before.position_m);
  EXPECT_EQ(run.after.velocity_mps, run.before.velocity_mps);
}

TEST_P(FieldOnEveryExecutor, ABrokenStrandIsNothingToItsNeighbours) {
  Groom groom = make_hair({.strand_count = 20});
  StrandState strands(executor_);
  ASSERT_TRUE(strands.load(groom, kTurned));
  auto collider = FieldCollider::make(executor_, {}, strands, {}, ball());
  ASSERT_TRUE(collider);
  SolverState state = disturbed(groom, strands.layout(), kTurned, 1.0);
  const auto run = [&](const SolverState& from) {
    strands.write(from);
    StepInput input = calm_input(kSubstepS);
    input.world_from_head_rotation = kTurned;
    collider->run(make_step_block(input, {}, strands.layout().counts(), strands.head()), strands.planes(),
                  {});
    SolverState to;
    strands.read(to);
    return to;
  };
  const SolverState expected = run(state);
  SolverState broken = state;
  broken.position_m[strands.layout().index(4, 7)] = glm::vec3(std::numeric_limits<float>::quiet_NaN());
  const SolverState found = run(broken);
  for (size_t i = 0; i < found.position_m.size(); ++i) {
    if (i % 20 == 7) continue;
    ASSERT_EQ(found.position_m[i], expected.position_m[i]) << i;
  }
  // Mended, it is like any other: nothing of the broken state is left.
  const SolverState mended = run(state);
  for (const glm::vec3& point : mended.position_m) ASSERT_TRUE(std::isfinite(point.x + point.y + point.z));
}

INSTANTIATE_TEST_SUITE_P(Of, FieldOnEveryExecutor, testing::ValuesIn(sim_devices()), name_of_device);

TEST(FieldColliderLanes, HaveTheSameBitsForEveryInstructionSetAndNumberOfThreads) {
  const Groom groom = make_hair({.strand_count = 77});
  std::optional<PassRun> first;
  for (const simd::InstructionSet set : lane_sets())
    for (const uint32_t threads : {1u, 3u}) {
      const auto executor = make_lanes_executor(LaneOptions{set, own_workers(threads)});
      const PassRun run = run_pass(*executor, groom, 0.8);
      if (!first) first = run;
      EXPECT_EQ(run.after.position_m, first->after.position_m) << simd::to_string(set);
      EXPECT_EQ(run.after.velocity_mps, first->after.velocity_mps) << simd::to_string(set);
      EXPECT_EQ(run.axis, first->axis) << simd::to_string(set);
    }
}

// ---- whole solvers ----

class FieldSolvers : public SolverTest {
 protected:
  std::unique_ptr<Solver> make_kept_out(const SolverKind& kind, const Groom& groom,
                                        const SolverParameters& given = {}) {
    SceneFeatures features;
    features.has_distance_field = true;
    const auto parameters = complete_parameters(*kind.row, known_parameters(*kind.row, given));
    SolverContext context{&executors_.on(*kind.host.device), features};
    context.head_field = std::shared_ptr<const DistanceField>(&ball(), [](const DistanceField*) {});
    auto solver = kind.row->make(*parameters, context);
    EXPECT_TRUE(solver) << solver.error().to_string();
    const Status loaded = (*solver)->load(groom, {1.0, 0.0, 0.0, 0.0});
    EXPECT_TRUE(loaded) << loaded.error().to_string();
    return std::move(solver).value();
  }
  /// All on lanes; on OpenGL those whose kernels differ from all others in what they keep.
  static std::vector<SolverKind> kernel_kinds() {
    std::vector<SolverKind> kinds;
    for (const SolverRow& row : solver_table()) {
      if (!row.has_kernel) continue;
      kinds.push_back({&row, kLanesHost});
      if (row.name == "dftl" || row.name == "dftl_parallel" || row.name == "direct_rod")
        kinds.push_back({&row, kGlHost});
    }
    return kinds;
  }
};

/// 10 g at 5 Hz with yaw of 30 degrees at 3 Hz.
Pose shake(double t) {
  const double rate = 2.0 * std::numbers::pi * 5.0;
  return {glm::dvec3(10.0 * 9.80665 / (rate * rate) * std::sin(rate * t), 0.0, 0.0),
          glm::angleAxis(std::numbers::pi / 6.0 * std::sin(2.0 * std::numbers::pi * 3.0 * t),
                         glm::dvec3(0.0, 1.0, 0.0))};
}
StepInput shake_input(int step) {
  const Pose before = shake((step - 1) * kSubstepS), now = shake(step * kSubstepS);
  StepInput input;
  input.h_s = kSubstepS;
  input.head_shift_m = now.position_m - before.position_m;
  input.world_from_head_rotation = now.rotation;
  return input;
}

struct Depths {
  double vertex_m = 0.0, middle_m = 0.0;
};
/// Below the clearances that strands have.
Depths depths_of(const Groom& groom, const SolverState& state, const glm::dquat& rotation) {
  const uint32_t strands = groom.strand_count();
  Depths deepest;
  for (uint32_t s = 0; s < strands; ++s)
    for (uint32_t i = 1; i < groom.vertex_count(s); ++i) {
      const glm::dquat turn = glm::conjugate(rotation);
      const glm::dvec3 a = turn * glm::dvec3(state.position_m[(i - 1) * strands + s]),
                       b = turn * glm::dvec3(state.position_m[i * strands + s]);
      const glm::dvec3 p(groom.rest_position_m[groom.offset[s] + i - 1]),
          q(groom.rest_position_m[groom.offset[s] + i]);
      deepest.vertex_m =
          std::max(deepest.vertex_m, field_clearance_m(ball(), q) - ball().sample(b).distance_m);
      deepest.middle_m = std::max(deepest.middle_m, field_clearance_m(ball(), 0.5 * (p + q)) -
                                                        ball().sample(0.5 * (a + b)).distance_m);
    }
  return deepest;
}

TEST_F(FieldSolvers, StayOutOfTheHeadInAShakeAndSettleOnIt) {
  const Groom groom = make_hair({.strand_count = 32, .vertex_count = 12});
  for (const SolverKind& kind : kernel_kinds()) {
    SCOPED_TRACE(kind.name());
    auto solver = make_kept_out(kind, groom);
    Depths worst;
    glm::dquat rotation(1.0, 0.0, 0.0, 0.0);
    for (int step = 1; step <= 60; ++step) {
      const StepInput input = shake_input(step);
      rotation = input.world_from_head_rotation;
      solver->substep(input);
      const Depths depths = depths_of(groom, read(*solver), rotation);
      worst.vertex_m = std::max(worst.vertex_m, depths.vertex_m);
      worst.middle_m = std::max(worst.middle_m, depths.middle_m);
    }
    StepInput rest;
    rest.h_s = kSubstepS;
    rest.world_from_head_rotation = rotation;
    for (int step = 0; step < 300; ++step) solver->substep(rest);
    const Depths settled = depths_of(groom, read(*solver), rotation);
    fmt::print("{}: shaken {:.3f} mm, middles {:.3f}; settled {:.4f} mm, middles {:.4f}\n", kind.name(),
               1e3 * worst.vertex_m, 1e3 * worst.middle_m, 1e3 * settled.vertex_m, 1e3 * settled.middle_m);
    EXPECT_LE(worst.vertex_m, 1e-3);
    EXPECT_LE(settled.vertex_m, 2e-5);
  }
}

}  // namespace
}  // namespace strandcast::field_collider_test

// Laws of strands that meet a body of capsules and planes, for every row of the solver table that has a
// kernel and on every executor: parity with the law in double, lengths, how deep strands end under a shoulder
// that moves, belts, that what begins inside stays and what is thin is not passed.
#include "server/sim/body_collider.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>

#include "common/base/quantile.h"
#include "common/kernels/lane_program.h"
#include "common/motion/bvh.h"
#include "common/scene/scene_desc.h"
#include "server/scene/step_builder.h"
#include "server/sim/executor/lanes_executor.h"
#include "server/sim/reference_body.h"
#include "tests/support/own_workers.h"
#include "tests/support/shared_data.h"
#include "tests/support/solver_bounds.h"
#include "tests/support/solver_fixture.h"

namespace strandcast::body_collider_test {
namespace {

constexpr double kSubstepS = 1.0 / 60.0;
constexpr double kFriction = 0.3;
constexpr double kHeadM = 0.09;
/// The fastest shoulder of three clips, seen from the head (the head turns, the body does not).
constexpr double kShoulderMps = 2.25;
const glm::dquat kTurned = glm::angleAxis(0.7, glm::normalize(glm::dvec3(1.0, 2.0, -0.5)));

BodyCapsule ball(const glm::dvec3& center_m, double radius_m) {
  return {center_m, center_m, center_m, center_m, radius_m, radius_m};
}
BodyCapsule capsule(const glm::dvec3& from_m, const glm::dvec3& to_m, double from_radius_m,
                    double to_radius_m) {
  return {from_m, to_m, from_m, to_m, from_radius_m, to_radius_m};
}
void move(BodyCapsule& shape, const glm::dvec3& way_m) {
  shape.from_before_m = shape.from_m;
  shape.to_before_m = shape.to_m;
  shape.from_m += way_m;
  shape.to_m += way_m;
}

/// Shoulders, a neck that narrows, and the head as a ball.
BodyInput upper_body() {
  BodyInput body;
  body.capsules = {ball({0.0, 0.0, 0.0}, kHeadM),
                   capsule({0.0, -0.2, -0.02}, {0.0, -0.09, -0.01}, 0.07, 0.045),
                   capsule({-0.17, -0.22, -0.02}, {0.17, -0.22, -0.02}, 0.05, 0.05)};
  body.planes = {{{0.0, -0.3, 0.0}, {0.0, 1.0, 0.0}, glm::dvec3(0.0)}};
  body.friction = kFriction;
  return body;
}

struct Hair {
  uint32_t strand_count = 60;
  uint32_t vertex_count = 14;
  double segment_m = 0.02;
};

/// Strands from all over a ball, that leave it and hang.
Groom make_hair(const Hair& hair) {
  std::mt19937 random(11);
  std::normal_distribution<double> any(0.0, 1.0);
  std::vector<std::vector<glm::vec3>> strands;
  for (uint32_t s = 0; s < hair.strand_count; ++s) {
    glm::dvec3 out = glm::normalize(glm::dvec3(any(random), any(random), any(random)));
    out.y = std::max(out.y, 0.1);
    out.z *= 0.25;  // above the shoulders
    out = glm::normalize(out);
    glm::dvec3 point = (kHeadM + 0.001) * out;
    std::vector<glm::vec3> strand;
    for (uint32_t i = 0; i < hair.vertex_count; ++i) {
      strand.emplace_back(point);
      const double fall = std::min(1.0, 0.25 * i);
      point += hair.segment_m *
               glm::normalize((1.0 - fall) * out + fall * glm::dvec3(0.25 * out.x, -1.0, 0.25 * out.z));
    }
    strands.push_back(strand);
  }
  return groom_from(strands, Pinning::Root);
}

/// One run of the pass over strands that somebody put somewhere, after one that saw them as groomed.
struct PassRun {
  StrandLayout layout;
  SolverState before, after;
  std::vector<glm::vec4> way, axis, velocity;
};

SolverState bent(const Groom& groom, const StrandLayout& layout, double angle_rad) {
  std::mt19937 random(5);
  std::normal_distribution<double> any(0.0, 1.0);
  SolverState state;
  state.position_m.resize(layout.size());
  state.velocity_mps.resize(layout.size());
  for (uint32_t s = 0; s < layout.strand_count; ++s) {
    const glm::vec3* rest = groom.rest_position_m.data() + groom.offset[s];
    glm::dvec3 point = rest[0];
    const glm::dquat bend = glm::angleAxis(angle_rad * any(random),
                                           glm::normalize(glm::dvec3(any(random), any(random), any(random))));
    for (uint32_t i = 0; i < layout.vertex_count; ++i) {
      if (i > 0) point += bend * (glm::dvec3(rest[i]) - glm::dvec3(rest[i - 1]));
      state.position_m[layout.index(i, s)] = glm::vec3(kTurned * point);
      state.velocity_mps[layout.index(i, s)] = glm::vec3(any(random), any(random), any(random));
    }
  }
  return state;
}

PassRun run_pass(Executor& executor, const Groom& groom, BodyInput body, double angle_rad) {
  PassRun run;
  StrandState strands(executor);
  EXPECT_TRUE(strands.load(groom, kTurned));
  run.layout = strands.layout();
  run.before = bent(groom, run.layout, angle_rad);
  std::vector<glm::vec4> filled(run.layout.size(), glm::vec4(0.001f, 0.002f, 0.003f, 4.0f));
  const auto way = executor.make_plane("way", run.layout.strand_count, filled);
  for (uint32_t s = 0; s < run.layout.strand_count; ++s)
    for (uint32_t i = 1; i < run.layout.vertex_count; ++i) {
      const glm::dvec3 edge = glm::dvec3(run.before.position_m[run.layout.index(i, s)]) -
                              glm::dvec3(run.before.position_m[run.layout.index(i - 1, s)]);
      filled[run.layout.index(i, s)] =
          glm::vec4(glm::vec3(glm::normalize(glm::cross(edge, glm::dvec3(0.3, 1.0, 0.7)))), 0.25f);
    }
  const auto axis = executor.make_plane("axis", run.layout.strand_count, filled);
  const CarriedPlanes carried{way.get(), axis.get()};
  auto collider = BodyCollider::make(executor, {}, strands, carried);
  EXPECT_TRUE(collider) << collider.error().to_string();
  StepInput input = calm_input(kSubstepS);
  input.world_from_head_rotation = kTurned;
  const auto step = [&] {
    collider->run(make_step_block(input, {}, run.layout.counts(), strands.head()), input, strands.planes(),
                  carried);
  };
  input.body.tip_clearance_m = body.tip_clearance_m;
  step();  // sees nothing, so everything has its clearance
  strands.write(run.before);
  strands.write_model(std::vector<float>(run.layout.size(), 3.5f));
  input.body = std::move(body);
  step();
  strands.read(run.after);
  way->read(run.way);
  axis->read(run.axis);
  BoundPlanes planes = strands.planes();
  plane_of(planes, PlaneRole::Velocity)->read(run.velocity);
  return run;
}

class BodyOnEveryExecutor : public testing::TestWithParam<SimDevice> {
 protected:
  SimExecutors executors_;
  Executor& executor_ = executors_.on(GetParam());
};

TEST_P(BodyOnEveryExecutor, DoesWhatTheLawSaysInDouble) {
  const Groom groom = make_hair({.strand_count = 400});
  for (const BodyResponse response : {BodyResponse::Turn, BodyResponse::Sphere, BodyResponse::Project}) {
    SCOPED_TRACE(kBodyResponses[static_cast<size_t>(response)]);
    BodyInput body = upper_body();
    body.response = response;
    body.tip_clearance_m = 0.004;
    move(body.capsules[2], {0.02, 0.025, 0.01});
    body.planes[0].shift_m = {0.01, 0.0, 0.0};
    const PassRun run = run_pass(executor_, groom, body, 1.0);
    const StrandLayout& layout = run.layout;
    const glm::dquat head_from_world = glm::conjugate(kTurned);
    size_t moved_count = 0;
    std::vector<double> errors_m;
    for (uint32_t s = 0; s < layout.strand_count; ++s) {
      std::vector<glm::dvec3> groomed, expected;
      std::vector<double> arc, clearance;
      for (uint32_t i = 0; i < layout.vertex_count; ++i) {
        groomed.emplace_back(layout.rest[layout.index(i, s)]);
        expected.push_back(head_from_world * glm::dvec3(run.before.position_m[layout.index(i, s)]));
        arc.push_back(static_cast<double>(i) / (layout.vertex_count - 1));
        clearance.push_back(1.0);
      }
      keep_out_of(body, {groomed, arc, layout.pinned_root_count, clearance, expected});
      for (uint32_t i = 0; i < layout.vertex_count; ++i) {
        const size_t at = layout.index(i, s);
        const glm::dvec3 now(run.after.position_m[at]), then(run.before.position_m[at]);
        errors_m.push_back(glm::distance(now, kTurned * expected[i]));
        const glm::dvec3 way = now - then;
        moved_count += glm::length(way) > 1e-6 ? 1 : 0;
        const glm::dvec3 gained =
            glm::dvec3(run.after.velocity_mps[at]) - glm::dvec3(run.before.velocity_mps[at]);
        ASSERT_LE(glm::distance(gained, way / kSubstepS), 1e-4) << "an impulse";
        ASSERT_LE(glm::distance(glm::dvec3(run.way[at]), glm::dvec3(0.001, 0.002, 0.003) + way), 1e-6);
        ASSERT_EQ(run.velocity[at].w, 3.5f);
        if (i == 0 || response == BodyResponse::Project) continue;
        const glm::dvec3 edge = now - glm::dvec3(run.after.position_m[layout.index(i - 1, s)]);
        ASSERT_LE(std::abs(glm::dot(glm::normalize(edge), glm::dvec3(run.axis[at]))), 1e-4) << "across";
        ASSERT_NEAR(glm::length(glm::dvec3(run.axis[at])), 1.0, 1e-6);
      }
    }
    fmt::print("{}: {} of {} moved; parity 95 % {:.2g} m, 99 % {:.2g} m, most {:.2g} m\n",
               kBodyResponses[static_cast<size_t>(response)], moved_count, layout.size(),
               quantile(errors_m, 0.95), quantile(errors_m, 0.99),
               *std::max_element(errors_m.begin(), errors_m.end()));
    EXPECT_GT(moved_count, layout.size() / 20) << "the strands do meet the body";
    EXPECT_LE(quantile(errors_m, 0.99), 2e-6);
    EXPECT_LE(quantile(errors_m, 1.0), 1e-5) << "where a choice is near to another";
    if (response != BodyResponse::Project) {
      EXPECT_LE(length_excess_m(groom, run.after, 2e-6), 0.0);
    }
  }
}

TEST_P(BodyOnEveryExecutor, WhatTouchesNothingIsNotMoved) {
  BodyInput body = upper_body();
  for (BodyCapsule& shape : body.capsules) move(shape, {0.0, -5.0, 0.0});
  body.planes[0].point_m.y -= 5.0;
  for (BodyCapsule& shape : body.capsules) move(shape, glm::dvec3(0.0));
  const PassRun run = run_pass(executor_, make_hair({}), body, 0.5);
  EXPECT_EQ(run.after.position_m, run.before.position_m);
  EXPECT_EQ(run.after.velocity_mps, run.before.velocity_mps);
}

/// Single segments beside each other over one ball, put somewhere by a model and turned out of it by the
/// pass, step after step. Seen from their starts, which stay.
class SegmentsOverABall {
 public:
  static constexpr uint32_t kCount = 16;
  static constexpr double kLengthM = 0.02, kBallM = 0.1;
  /// Their starts are so high over the ball.
  SegmentsOverABall(Executor& executor, double height_m)
      : strands_(executor), start_m_(0.0, kBallM + height_m, 0.0) {
    std::vector<std::vector<glm::vec3>> straight(
        kCount, {glm::vec3(start_m_), glm::vec3(start_m_ - glm::dvec3(0.0, kLengthM, 0.0))});
    EXPECT_TRUE(strands_.load(groom_from(straight, Pinning::Root), {1.0, 0.0, 0.0, 0.0}));
    auto collider = BodyCollider::make(executor, {}, strands_, {});
    EXPECT_TRUE(collider) << collider.error().to_string();
    collider_.emplace(std::move(collider).value());
  }
  /// Ends from the starts, by the model, and where the pass has them. Without a ball they stay.
  std::vector<glm::dvec3> step(const std::vector<glm::dvec3>& ends_m, bool has_ball) {
    const StrandLayout& layout = strands_.layout();
    SolverState state;
    state.position_m.resize(layout.size());
    state.velocity_mps.resize(layout.size());
    for (uint32_t s = 0; s < kCount; ++s)
      for (uint32_t i = 0; i < 2; ++i)
        state.position_m[layout.index(i, s)] = glm::vec3(i == 0 ? start_m_ : start_m_ + ends_m[s]);
    strands_.write(state);
    StepInput input = calm_input(kSubstepS);
    input.body.friction = 0.0;
    input.body.response = BodyResponse::Sphere;
    input.body.capsules = {ball({0.0, has_ball ? 0.0 : -5.0, 0.0}, kBallM)};
    collider_->run(make_step_block(input, {}, layout.counts(), strands_.head()), input, strands_.planes(),
                   {});
    strands_.read(state);
    std::vector<glm::dvec3> out(kCount);
    for (uint32_t s = 0; s < kCount; ++s)
      out[s] = glm::dvec3(state.position_m[layout.index(1, s)]) - start_m_;
    return out;
  }
  static glm::dvec3 leaning(double angle_rad, double around_rad) {
    return kLengthM * glm::dvec3(std::sin(angle_rad) * std::cos(around_rad), -std::cos(angle_rad),
                                 std::sin(angle_rad) * std::sin(around_rad));
  }

 private:
  StrandState strands_;
  glm::dvec3 start_m_;
  std::optional<BodyCollider> collider_;
};

/// Farthest that an end goes from one step to the next.
double largest_move_m(const std::vector<glm::dvec3>& from, const std::vector<glm::dvec3>& to) {
  double largest_m = 0.0;
  for (size_t s = 0; s < from.size(); ++s) largest_m = std::max(largest_m, glm::distance(from[s], to[s]));
  return largest_m;
}

// Woodhouse 2017, figure 4.1 has two roots in a plane, and a circle of them in space. A model that has
// segments point at the centre, a little beside it, on any side, and every step on another, moves them a
// little.
TEST_P(BodyOnEveryExecutor, WhatPointsAtTheCentreStaysOnItsSideOfTheBall) {
  constexpr double kUnsteadyM = 1e-4;
  SegmentsOverABall segments(executor_, 0.01);
  std::vector<glm::dvec3> model(SegmentsOverABall::kCount);
  for (size_t s = 0; s < model.size(); ++s) model[s] = segments.leaning(1.2, 0.4 * static_cast<double>(s));
  (void)segments.step(model, false);
  model.assign(model.size(), segments.leaning(0.0, 0.0));
  std::vector<glm::dvec3> shown = segments.step(model, true);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> around(0.0, 6.28), beside(0.0, kUnsteadyM / segments.kLengthM);
  double largest_m = 0.0;
  for (int i = 0; i < 200; ++i) {
    for (glm::dvec3& end : model) end = segments.leaning(beside(random), around(random));
    const std::vector<glm::dvec3> now = segments.step(model, true);
    largest_m = std::max(largest_m, largest_move_m(shown, now));
    shown = now;
  }
  // Both lie on the circle of solutions, of radius L sine; the side is at least 0.1 L / sqrt(2) long.
  const double most_m = 2.0 * kUnsteadyM * std::sqrt(2.0) / 0.1;
  fmt::print("ends move by {:.3g} mm at the most, {:.3g} mm as asked for\n", 1e3 * largest_m,
             2e3 * kUnsteadyM);
  EXPECT_LT(largest_m, most_m);
  EXPECT_GT(largest_m, 0.0);
}

// As far to the one side as to the other, in turns: the end is on one side of the ball, or on the other.
TEST_P(BodyOnEveryExecutor, WhatIsThrownFromSideToSideStaysOnOne) {
  SegmentsOverABall segments(executor_, 0.01);
  std::vector<glm::dvec3> model(SegmentsOverABall::kCount);
  const auto lean = [&](double angle_rad) {
    for (size_t s = 0; s < model.size(); ++s)
      model[s] =
          segments.leaning(angle_rad * (0.1 + 0.06 * static_cast<double>(s)), 0.4 * static_cast<double>(s));
  };
  lean(1.2);
  (void)segments.step(model, false);
  lean(0.4);
  const std::vector<glm::dvec3> first = segments.step(model, true);
  double sum_m = 0.0;
  for (int i = 0; i < 20; ++i) {
    lean(i % 2 == 0 ? -0.4 : 0.4);
    sum_m += largest_move_m(first, segments.step(model, true));
  }
  EXPECT_LT(sum_m / 20.0, 1e-5);
}

// Where the plane says enough it alone decides, as the two equations have it.
TEST_P(BodyOnEveryExecutor, WhatLeansFarGoesAroundTheBallWithTheModel) {
  SegmentsOverABall segments(executor_, 0.01);
  std::vector<glm::dvec3> model(SegmentsOverABall::kCount);
  const auto turn = [&](double around_rad) {
    for (glm::dvec3& end : model) end = segments.leaning(0.3, around_rad);
  };
  turn(0.0);
  (void)segments.step(model, false);
  for (int i = 1; i <= 60; ++i) {
    turn(0.1 * i);
    for (const glm::dvec3& end : segments.step(model, true)) {
      const double turned = std::remainder(std::atan2(end.z, end.x) - 0.1 * i, 2.0 * 3.14159265358979);
      ASSERT_NEAR(turned, 0.0, 1e-4) << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Of, BodyOnEveryExecutor, testing::ValuesIn(sim_devices()), name_of_device);

TEST(BodyColliderLanes, HaveTheSameBitsForEveryInstructionSetAndNumberOfThreads) {
  const Groom groom = make_hair({.strand_count = 77});
  BodyInput body = upper_body();
  move(body.capsules[2], {0.02, 0.025, 0.01});
  std::optional<PassRun> first;
  for (const simd::InstructionSet set : lane_sets())
    for (const uint32_t threads : {1u, 3u}) {
      const auto executor = make_lanes_executor(LaneOptions{set, own_workers(threads)});
      const PassRun run = run_pass(*executor, groom, body, 0.5);
      if (!first) first = run;
      EXPECT_EQ(run.after.position_m, first->after.position_m) << simd::to_string(set);
      EXPECT_EQ(run.after.velocity_mps, first->after.velocity_mps) << simd::to_string(set);
    }
}

// ---- whole solvers ----

class BodySolvers : public SolverTest {
 protected:
  std::unique_ptr<Solver> make_kept_out(const SolverKind& kind, const Groom& groom,
                                        const SolverParameters& given = {}) {
    SceneFeatures features;
    features.has_body = true;
    const auto parameters = complete_parameters(*kind.row, known_parameters(*kind.row, given));
    auto solver = kind.row->make(*parameters, {&executors_.on(*kind.host.device), features});
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

struct Depths {
  double vertex_m = 0.0, middle_m = 0.0;
};
Depths depths_of(const BodyInput& body, const Groom& groom, const SolverState& state) {
  const uint32_t strands = groom.strand_count();
  Depths deepest;
  for (uint32_t s = 0; s < strands; ++s)
    for (uint32_t i = 1; i < groom.vertex_count(s); ++i) {
      const glm::dvec3 a(state.position_m[(i - 1) * strands + s]), b(state.position_m[i * strands + s]);
      deepest.vertex_m = std::max(deepest.vertex_m, kBodyClearanceM - distance_to_body_m(body, b));
      deepest.middle_m =
          std::max(deepest.middle_m, kBodyClearanceM - distance_to_body_m(body, 0.5 * (a + b)));
    }
  return deepest;
}

constexpr int kRise = 30;   // steps in which neck and shoulders come up from below the hair
constexpr int kShrug = 90;  // steps in all
/// Then the shoulders go up and down and to the sides, 2.25 m/s at most: 37 mm in a step.
glm::dvec3 way_of_shoulder(int step) {
  constexpr double kRate = 2.0 * 3.14159265358979 * 3.0;
  if (step < kRise) return {0.0, -0.02 * (kRise - step), 0.0};
  return kShoulderMps / kRate * std::sin(kRate * kSubstepS * (step - kRise)) *
         glm::normalize(glm::dvec3(0.5, 1.0, 0.4));
}
BodyInput shrug(int step) {
  BodyInput body = upper_body();
  body.planes.clear();
  body.capsules.erase(body.capsules.begin());  // the head
  BodyCapsule& shoulders = body.capsules[1];
  move(shoulders, way_of_shoulder(step - 1));
  move(shoulders, way_of_shoulder(step) - way_of_shoulder(step - 1));
  if (step <= kRise) {
    move(body.capsules[0], way_of_shoulder(step - 1));
    move(body.capsules[0], way_of_shoulder(step) - way_of_shoulder(step - 1));
  }
  return body;
}

TEST_F(BodySolvers, StayOutOfAShoulderThatMovesAndSettleOnIt) {
  const Groom groom = make_hair({.strand_count = 32, .vertex_count = 20});
  for (const SolverKind& kind : kernel_kinds()) {
    SCOPED_TRACE(kind.name());
    auto solver = make_kept_out(kind, groom);
    Depths worst;
    StepInput input;
    input.h_s = kSubstepS;
    double fastest_m = 0.0;
    for (int step = 1; step <= kShrug; ++step) {
      input.body = shrug(step);
      solver->substep(input);
      const Depths depths = depths_of(input.body, groom, read(*solver));
      fastest_m = std::max(
          fastest_m, glm::distance(input.body.capsules[1].from_m, input.body.capsules[1].from_before_m));
      worst.vertex_m = std::max(worst.vertex_m, depths.vertex_m);
      worst.middle_m = std::max(worst.middle_m, depths.middle_m);
    }
    EXPECT_GT(fastest_m, 0.036) << "37 mm in a step";
    for (BodyCapsule& shape : input.body.capsules) move(shape, glm::dvec3(0.0));
    for (int step = 0; step < 1200; ++step) solver->substep(input);
    const SolverState settled = read(*solver);
    solver->substep(input);
    double squares = 0.0;
    const SolverState now = read(*solver);
    std::vector<double> speeds_mmps;
    for (size_t i = 0; i < now.position_m.size(); ++i) {
      const glm::dvec3 way_m(now.position_m[i] - settled.position_m[i]);
      squares += glm::dot(way_m, way_m);
      speeds_mmps.push_back(1e3 / kSubstepS * glm::length(way_m));
    }
    const double speed_mmps =
        1e3 / kSubstepS * std::sqrt(squares / static_cast<double>(now.position_m.size()));
    size_t leaning_count = 0;
    for (const glm::vec3& point : now.position_m)
      leaning_count += distance_to_body_m(input.body, point) < 0.002 ? 1 : 0;
    EXPECT_GT(leaning_count, 10u) << "hair lies on the shoulders";
    const Depths at_rest = depths_of(input.body, groom, now);
    fmt::print("{}: moved {:.3f} mm, middles {:.3f}; settled {:.4f} mm, middles {:.4f}; {:.2g} mm/s\n",
               kind.name(), 1e3 * worst.vertex_m, 1e3 * worst.middle_m, 1e3 * at_rest.vertex_m,
               1e3 * at_rest.middle_m, speed_mmps);
    EXPECT_LE(worst.vertex_m, 1e-3);
    EXPECT_LE(worst.middle_m, 3e-3);
    EXPECT_LE(at_rest.vertex_m, 2e-4);
    if (kind.row->comes_to_rest) {
      // A rod that stands on an edge may rock there, by less than a tenth of a millimetre: 1 of these 32
      // does.
      EXPECT_LE(quantile(speeds_mmps, 0.95), 0.5);
      EXPECT_LE(speed_mmps, kind.row->name == "direct_rod" ? 2.0 : 0.5);
    }
    if (kind.row->stretch_bound == 0.0) {
      EXPECT_LE(length_excess_m(groom, now, 2e-5), 0.0);
    }
  }
}

const SolverRow& row_of(const std::string& name) {
  return **find_solver(name);
}

TEST_F(BodySolvers, ABeltCarriesStrandsByFrictionAndNotWithoutIt) {
  // Straight strands that lie on a belt, which moves along them and across.
  std::vector<std::vector<glm::vec3>> curves;
  for (int s = 0; s < 8; ++s) {
    std::vector<glm::vec3> curve;
    for (int i = 0; i < 12; ++i)
      curve.emplace_back(0.02f * static_cast<float>(i), 0.001f, 0.05f * static_cast<float>(s));
    curves.push_back(curve);
  }
  const Groom groom = groom_from(curves, Pinning::Root);
  for (const char* name : {"dftl", "xpbd", "direct_rod"})
    for (const double friction : {0.0, 1.0}) {
      SCOPED_TRACE(fmt::format("{} {}", name, friction));
      auto solver = make_kept_out({&row_of(name), kLanesHost}, groom, {{"style_stiffness_per_s2", 0.0}});
      StepInput input;
      input.h_s = kSubstepS;
      input.body.planes = {{glm::dvec3(0.0), {0.0, 1.0, 0.0}, glm::dvec3(0.0)}};
      input.body.friction = friction;
      for (int step = 0; step < 120; ++step) solver->substep(input);
      const SolverState before = read(*solver);
      input.body.planes[0].shift_m = {0.0, 0.0, 0.1 * kSubstepS};  // 0.1 m/s to the side
      for (int step = 0; step < 30; ++step) solver->substep(input);
      const SolverState after = read(*solver);
      // Of the tips, which are free to go: along with the belt for half a second, less what the root holds.
      double way_m = 0.0;
      for (uint32_t s = 0; s < 8; ++s)
        way_m += (after.position_m[11 * 8 + s] - before.position_m[11 * 8 + s]).z / 8.0;
      fmt::print("{}: friction {}: carried {:.1f} mm of 50\n", name, friction, 1e3 * way_m);
      if (friction == 0.0) {
        EXPECT_NEAR(way_m, 0.0, 1e-3);
      } else {
        EXPECT_GT(way_m, 0.035);
      }
    }
}

TEST_F(BodySolvers, WhatBeginsInsideStaysAndComesNoDeeperAgain) {
  // Horizontal strands, some of them begin in a ball, without weight: as loaded nothing moves.
  std::vector<std::vector<glm::vec3>> curves;
  for (int s = 0; s < 16; ++s) {
    std::vector<glm::vec3> curve;
    for (int i = 0; i < 12; ++i)
      curve.emplace_back(0.02f * static_cast<float>(i), 0.01f * static_cast<float>(s), 0.0f);
    curves.push_back(curve);
  }
  const Groom groom = groom_from(curves, Pinning::Root);
  BodyInput body;
  body.capsules = {ball({0.12, 0.0, 0.0}, 0.06)};
  double deepest_m = 0.0;
  for (const glm::vec3& point : groom.rest_position_m)
    deepest_m = std::max(deepest_m, -distance_to_body_m(body, point));
  EXPECT_GT(deepest_m, 0.05);
  auto solver = make_kept_out({&row_of("dftl"), kLanesHost}, groom);
  StepInput input = calm_input(kSubstepS);
  input.body = body;
  input.body.is_new = true;
  for (int step = 0; step < 60; ++step) {
    solver->substep(input);
    input.body.is_new = false;
  }
  const SolverState still = read(*solver);
  for (size_t i = 0; i < still.position_m.size(); ++i)
    ASSERT_LE(glm::distance(still.position_m[i], groom.rest_position_m[(i % 16) * 12 + i / 16]), 1e-5f) << i;
  // A wind from below takes them out; then they lie on the ball like all others.
  input.gravity_mps2 = {0.0, 20.0, 0.0};
  for (int step = 0; step < 90; ++step) solver->substep(input);
  input.gravity_mps2 = {0.0, -9.81, 0.0};
  for (int step = 0; step < 300; ++step) solver->substep(input);
  const Depths after = depths_of(body, groom, read(*solver));
  EXPECT_LE(after.vertex_m, 1e-3) << "out once, out for good";
}

TEST_F(BodySolvers, AThinAndFastCapsuleIsNotPassed) {
  // A bar of 20 mm that sweeps hanging strands at 2.25 m/s: in a step nearly twice as far as it is thick.
  const Groom groom = make_hair({.strand_count = 24, .vertex_count = 38, .segment_m = 0.01});
  for (const char* name : {"xpbd", "mass_spring"}) {
    SCOPED_TRACE(name);
    auto solver = make_kept_out({&row_of(name), kLanesHost}, groom);
    StepInput input;
    input.h_s = kSubstepS;
    for (int step = 0; step < 200; ++step) solver->substep(input);
    BodyCapsule bar = capsule({-0.4, -0.15, -0.3}, {0.4, -0.15, -0.3}, 0.01, 0.01);
    for (int step = 0; step < 10; ++step) {
      move(bar, {0.0, 0.0, step == 0 ? 0.0 : kShoulderMps * kSubstepS});
      input.body.capsules = {bar};
      solver->substep(input);
    }
    // Where a strand comes down to the height of the bar, it does so in front of it.
    const SolverState after = read(*solver);
    size_t met_count = 0, passed_count = 0;
    for (uint32_t s = 0; s < 24; ++s)
      for (uint32_t i = 1; i < 38; ++i) {
        const glm::vec3 a = after.position_m[(i - 1) * 24 + s], b = after.position_m[i * 24 + s];
        if (a.y < -0.15f || b.y > -0.15f) continue;
        ++met_count;
        passed_count +=
            glm::mix(a, b, (a.y + 0.15f) / (a.y - b.y)).z < static_cast<float>(bar.from_m.z) ? 1 : 0;
        break;
      }
    fmt::print("{}: {} of {} strands were passed\n", name, passed_count, met_count);
    EXPECT_GT(met_count, 12u);
    // Without regard to where they were nearly all of them are. What slips through does so between two
    // vertices.
    EXPECT_LE(passed_count, met_count / 8);
  }
}

TEST_F(BodySolvers, TheOrderOfStrandsIsNothingToThem) {
  const Groom groom = make_hair({.strand_count = 40, .vertex_count = 20});
  std::vector<uint32_t> order(40);
  for (uint32_t s = 0; s < 40; ++s) order[s] = (s * 17 + 5) % 40;
  std::vector<std::vector<glm::vec3>> curves;
  for (const uint32_t s : order)
    curves.emplace_back(groom.rest_position_m.begin() + groom.offset[s],
                        groom.rest_position_m.begin() + groom.offset[s + 1]);
  const Groom shuffled = groom_from(curves, Pinning::Root);
  // A model without strand-to-strand differences of its own.
  auto a = make_kept_out({&row_of("xpbd"), kLanesHost}, groom),
       b = make_kept_out({&row_of("xpbd"), kLanesHost}, shuffled);
  StepInput input;
  input.h_s = kSubstepS;
  for (int step = 1; step <= kShrug; ++step) {
    input.body = shrug(step);
    a->substep(input);
    b->substep(input);
  }
  const SolverState in_order = read(*a), in_disorder = read(*b);
  for (uint32_t i = 0; i < 20; ++i)
    for (uint32_t s = 0; s < 40; ++s)
      ASSERT_EQ(in_disorder.position_m[i * 40 + s], in_order.position_m[i * 40 + order[s]]) << i << ' ' << s;
}

TEST_F(BodySolvers, TipsStayFurtherAwayThanRootsWhereTheBodyAsksForIt) {
  const Groom groom = make_hair({.strand_count = 32, .vertex_count = 20});
  constexpr double kTipM = 0.012;
  auto solver = make_kept_out({&row_of("dftl"), kLanesHost}, groom);
  StepInput input;
  input.h_s = kSubstepS;
  for (int step = 1; step <= 300; ++step) {
    input.body = shrug(std::min(step, kShrug));
    if (step > kShrug)
      for (BodyCapsule& shape : input.body.capsules) move(shape, glm::dvec3(0.0));
    input.body.tip_clearance_m = kTipM;
    solver->substep(input);
  }
  const SolverState state = read(*solver);
  double least_m = 1.0;
  for (uint32_t s = 0; s < 32; ++s) {
    const double tip_m = distance_to_body_m(input.body, state.position_m[19 * 32 + s]);
    least_m = std::min(least_m, tip_m);
  }
  EXPECT_GE(least_m, kTipM - 1e-4);
  EXPECT_LE(least_m, kTipM + 0.02) << "some of them do lie there";
}

TEST_F(BodySolvers, ARealBodyIsNotEnteredByHairThatBeganOutsideOfIt) {
  const std::filesystem::path file =
      std::filesystem::path(STRANDCAST_SHARED_DATA) / "mocap" / "cmu_01_01_playground_jumps.bvh";
  REQUIRE_SHARED(file);
  BvhOptions options;
  options.has_body = true;
  const auto clip = load_bvh(file, options);
  ASSERT_TRUE(clip) << clip.error().to_string();
  const Groom groom = make_hair({.strand_count = 48, .vertex_count = 20});
  SceneDesc scene = built_in_scene();
  scene.body.preset = kUpperBody;
  scene.wind = {};
  SceneFeatures features;
  features.has_body = true;
  for (const char* name : {"dftl", "xpbd", "direct_rod"}) {
    SCOPED_TRACE(name);
    auto solver = make_kept_out({&row_of(name), kLanesHost}, groom);
    StepBuilder builder(scene, {});
    std::vector<bool> began_inside(groom.strand_count(), false);
    std::vector<double> depths_m;
    double fastest_mps = 0.0;
    // From the first jump on: as far as five seconds go.
    for (int step = 0; step < 300; ++step) {
      InputFrame input;
      input.has_motion = true;
      const double t_s = 4.0 + step * kSubstepS;
      input.world_from_head = clip->sample(t_s);
      input.joints = {clip->joint_name, clip->sample_joints(t_s)};
      const SceneStep& built = builder.build(input, features, step * kSubstepS);
      if (built.carried_to_rotation) solver->rebase(*built.carried_to_rotation);
      for (const StepInput& substep : built.substeps) solver->substep(substep);
      const BodyInput& body = built.substeps.back().body;
      ASSERT_EQ(body.capsules.size(), preset_size(kUpperBody));
      for (const BodyCapsule& shape : body.capsules)
        fastest_mps = std::max(fastest_mps, glm::distance(shape.to_m, shape.to_before_m) / kSubstepS);
      if (step % 4 != 0) continue;
      const SolverState state = read(*solver);
      const glm::dquat turn = glm::conjugate(input.world_from_head.rotation);
      for (uint32_t s = 0; s < groom.strand_count(); ++s)
        for (uint32_t i = 1; i < 20; ++i) {
          const glm::dvec3 a = turn * glm::dvec3(state.position_m[(i - 1) * groom.strand_count() + s]);
          const glm::dvec3 b = turn * glm::dvec3(state.position_m[i * groom.strand_count() + s]);
          const double inside_m =
              -std::min(distance_to_body_m(body, b), distance_to_body_m(body, 0.5 * (a + b)));
          if (step == 0)
            began_inside[s] = began_inside[s] || inside_m > 0.0;
          else if (!began_inside[s])
            depths_m.push_back(std::max(0.0, inside_m));
        }
    }
    ASSERT_FALSE(depths_m.empty());
    EXPECT_GT(fastest_mps, 1.5) << "a body that jumps";
    fmt::print(
        "{}: fastest {:.2f} m/s; {} strands began inside, the others get {:.3f} mm deep, 99.9 % {:.3f}\n",
        name, fastest_mps, std::count(began_inside.begin(), began_inside.end(), true),
        1e3 * *std::max_element(depths_m.begin(), depths_m.end()), 1e3 * quantile(depths_m, 0.999));
    EXPECT_LE(quantile(depths_m, 0.999), 1e-3);
  }
}

}  // namespace
}  // namespace strandcast::body_collider_test

// Strands that follow others: groomed where those are groomed, as long as ever, and with the head.
#include "server/sim/followed_solver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/groom/mesh.h"
#include "common/groom/procedural.h"
#include "common/math/pose.h"
#include "server/sim/solver_registry.h"
#include "tests/support/meshes.h"
#include "tests/support/sim_devices.h"

namespace strandcast::strand_follow_test {
namespace {

constexpr uint32_t kStrands = 200;
constexpr uint32_t kVertices = 12;
constexpr uint32_t kGuides = 50;

Groom grown() {
  ProceduralGroomOptions options;
  options.strand_count = kStrands;
  options.vertex_count = kVertices;
  options.length_m = 0.2f;
  auto groom = grow_groom(make_scalp_cap(glm::vec3(0.0f), 0.095f, 1000), options);
  EXPECT_TRUE(groom.ok());
  return with_pinning(reorder(*groom, make_prefix_order(*groom)), Pinning::RootPair);
}

std::vector<glm::vec3> rest_of(const Groom& groom, uint32_t count) {
  std::vector<glm::vec3> rest(size_t{count} * kVertices);
  for (uint32_t s = 0; s < count; ++s)
    for (uint32_t v = 0; v < kVertices; ++v) rest[v * count + s] = groom.rest_position_m[groom.offset[s] + v];
  return rest;
}

TEST(StrandFollow, AtRestAllAreGroomed) {
  const Groom groom = grown();
  const StrandFollow follow(groom, kGuides);
  std::vector<glm::vec3> all(size_t{kStrands} * kVertices);
  follow.follow(rest_of(groom, kGuides), all);
  const std::vector<glm::vec3> rest = rest_of(groom, kStrands);
  for (size_t i = 0; i < all.size(); ++i) ASSERT_LT(glm::distance(all[i], rest[i]), 1e-6f) << i;
}

TEST(StrandFollow, KeepsEveryLengthAndTheRootsWhateverGuidesDo) {
  const Groom groom = grown();
  const StrandFollow follow(groom, kGuides);
  const std::vector<glm::vec3> rest = rest_of(groom, kStrands);
  std::mt19937 random(3);
  std::normal_distribution<float> noise(0.0f, 0.05f);
  std::vector<glm::vec3> guides = rest_of(groom, kGuides);
  for (size_t i = size_t{2} * kGuides; i < guides.size(); ++i)
    guides[i] += glm::vec3(noise(random), noise(random), noise(random));
  // Some that are nowhere, and some turned over.
  for (uint32_t v = 2; v < kVertices; ++v) {
    guides[v * kGuides] = guides[kGuides];
    guides[v * kGuides + 1] = 2.0f * guides[kGuides + 1] - rest_of(groom, kGuides)[v * kGuides + 1];
  }
  std::vector<glm::vec3> all(rest.size());
  follow.follow(guides, all);
  for (uint32_t s = 0; s < kStrands; ++s) {
    for (uint32_t v = 0; v < kVertices; ++v) {
      const size_t i = size_t{v} * kStrands + s;
      ASSERT_TRUE(std::isfinite(glm::length(all[i])));
      if (s < kGuides) {
        ASSERT_EQ(all[i], guides[size_t{v} * kGuides + s]);
        continue;
      }
      if (v < 2) {
        ASSERT_EQ(all[i], rest[i]) << "roots are the head's";
        continue;
      }
      const float length = glm::distance(rest[i], rest[i - kStrands]);
      ASSERT_NEAR(glm::distance(all[i], all[i - kStrands]), length, 1e-5f * length + 1e-7f) << s << " " << v;
    }
  }
}

// Strands that are alike and beside each other do the same.
TEST(StrandFollow, AStrandGroomedAsItsGuideGoesAsItsGuide) {
  Groom groom = first_strands(grown(), 2);
  const glm::vec3 apart(0.001f, 0.0f, 0.002f);
  for (uint32_t v = 0; v < kVertices; ++v)
    groom.rest_position_m[groom.offset[1] + v] = groom.rest_position_m[v] + apart;
  const StrandFollow follow(groom, 1);
  std::vector<glm::vec3> guide = rest_of(groom, 1);
  for (uint32_t v = 2; v < kVertices; ++v)
    guide[v] += glm::vec3(0.0f, 0.0f, 0.004f * static_cast<float>(v * v));
  // As long as it was.
  const std::vector<glm::vec3> rest = rest_of(groom, 1);
  for (uint32_t v = 2; v < kVertices; ++v)
    guide[v] = guide[v - 1] + glm::normalize(guide[v] - guide[v - 1]) * glm::distance(rest[v], rest[v - 1]);
  std::vector<glm::vec3> all(size_t{2} * kVertices);
  follow.follow(guide, all);
  for (uint32_t v = 0; v < kVertices; ++v)
    EXPECT_LT(glm::distance(all[2 * v + 1], all[2 * v] + apart), 1e-5f) << v;
}

/// How deep a vertex of these lies in a sphere, at most; less than nothing: none.
double deepest_m(std::span<const glm::vec3> all, const SphereCollider& sphere, uint32_t first_strand) {
  double deepest = -INFINITY;
  for (size_t i = 0; i < all.size(); ++i)
    if (i % kStrands >= first_strand)
      deepest = std::max(deepest, double{sphere.radius_m - glm::distance(all[i], sphere.center_m)});
  return deepest;
}

/// Guides with all that is free of them turned about their roots.
std::vector<glm::vec3> turned_guides(const Groom& groom, uint32_t pinned, float angle_rad) {
  std::vector<glm::vec3> guides = rest_of(groom, kGuides);
  const glm::quat turn = glm::angleAxis(angle_rad, glm::vec3(0.0f, 0.0f, 1.0f));
  for (size_t i = size_t{pinned} * kGuides; i < guides.size(); ++i) {
    const glm::vec3 root = guides[size_t{pinned - 1} * kGuides + i % kGuides];
    guides[i] = root + turn * (guides[i] - root);
  }
  return guides;
}

TEST(StrandFollow, WhatGuidesCollideWithFollowersDoNotEnter) {
  constexpr float kRadiusM = 0.1f;
  const Groom groom = grown();
  const StrandFollow follow(groom, kGuides);
  const std::vector<glm::vec3> rest = rest_of(groom, kStrands);
  const std::vector<glm::vec3> guides = turned_guides(groom, follow.pinned_count(), 0.9f);
  const auto ball =
      std::make_shared<const DistanceField>(make_distance_field(make_icosphere(kRadiusM, 4), 48).value());
  for (const bool is_field : {false, true}) {
    SCOPED_TRACE(is_field ? "field" : "spheres");
    FollowedSkin skin;
    const SphereCollider sphere{glm::vec3(0.0f), kRadiusM};
    if (is_field)
      skin.field = ball;
    else
      skin.spheres = {sphere};
    std::vector<glm::vec3> free(rest.size()), held(rest.size());
    follow.follow(guides, free);
    follow.follow(guides, held, skin);
    const double groomed_m = std::max(0.0, deepest_m(rest, sphere, kGuides));
    EXPECT_GT(deepest_m(free, sphere, kGuides), groomed_m + 0.01) << "without it they enter";
    // As deep as the groom itself has it, and no deeper; a field is coarse.
    EXPECT_LT(deepest_m(held, sphere, kGuides), groomed_m + (is_field ? 1e-3 : 1e-5));
    for (size_t i = kStrands; i < held.size(); ++i)
      ASSERT_NEAR(glm::distance(held[i], held[i - kStrands]), glm::distance(rest[i], rest[i - kStrands]),
                  2e-6);
    for (size_t v = 0; v < kVertices; ++v)
      for (size_t s = 0; s < kGuides; ++s)
        ASSERT_EQ(held[v * kStrands + s], guides[v * kGuides + s]) << "guides are the solver's";
  }
}

TEST(StrandFollow, ShareOfStrands) {
  EXPECT_EQ(guide_count(1000, 1.0), 1000u);
  EXPECT_EQ(guide_count(1000, 0.25), 250u);
  EXPECT_EQ(guide_count(3, 0.001), 1u);
  Groom groom = grown();
  EXPECT_TRUE(can_follow(groom));
  EXPECT_FALSE(can_follow(with_pinning(groom, Pinning::BothEnds))) << "tips would come loose";
}

constexpr uint32_t kStride = 2;

/// Strands that are bent at every vertex, each otherwise, as long as in the groom.
std::vector<glm::vec3> bent(const Groom& groom) {
  const uint32_t count = groom.strand_count();
  std::vector<glm::vec3> rest = rest_of(groom, count), moved = rest;
  std::mt19937 random(5);
  std::normal_distribution<float> noise(0.0f, 0.4f);
  for (size_t i = size_t{2} * count; i < moved.size(); ++i) {
    const glm::vec3 way = rest[i] - rest[i - count];
    const glm::vec3 to = glm::normalize(way) + glm::vec3(noise(random), noise(random), noise(random));
    moved[i] = moved[i - count] + glm::length(way) * glm::normalize(to);
  }
  return moved;
}

TEST(VertexFollow, KeepsRootsAndTipAndLeavesOutOthersEvenly) {
  const Groom groom = grown();
  const VertexFollow follow(groom, kStride);
  EXPECT_EQ(follow.kept(), (std::vector<uint32_t>{0, 1, 3, 5, 7, 9, 11}));
  EXPECT_EQ(VertexFollow(groom, 3).kept(), (std::vector<uint32_t>{0, 1, 2, 5, 8, 11}));
  EXPECT_EQ(VertexFollow(groom, 1).kept().size(), kVertices);
  EXPECT_EQ(VertexFollow(groom, 1000).kept(), (std::vector<uint32_t>{0, 1, 11}));
  const Groom fewer = follow.simulated(groom);
  ASSERT_EQ(fewer.strand_count(), kStrands);
  ASSERT_EQ(fewer.uniform_vertex_count(), follow.kept().size());
  for (uint32_t s = 0; s < kStrands; ++s)
    for (size_t k = 0; k < follow.kept().size(); ++k) {
      const size_t of_all = groom.offset[s] + follow.kept()[k];
      if (s % 50 != 0) continue;
      EXPECT_EQ(fewer.rest_position_m[fewer.offset[s] + k], groom.rest_position_m[of_all]);
      EXPECT_EQ(fewer.pinned[fewer.offset[s] + k], groom.pinned[of_all]);
    }
}

TEST(VertexFollow, AtRestAllAreGroomed) {
  const Groom groom = grown();
  const VertexFollow follow(groom, kStride);
  const std::vector<glm::vec3> rest = rest_of(groom, kStrands);
  std::vector<glm::vec3> kept(follow.kept_size()), all(rest.size());
  follow.take(rest, kept);
  follow.follow(kept, all);
  for (size_t i = 0; i < all.size(); ++i) ASSERT_LT(glm::distance(all[i], rest[i]), 1e-6f) << i;
}

TEST(VertexFollow, SimulatedOnesStandAndOthersLieBetweenThemInTheGroomsShape) {
  const Groom groom = grown();
  const VertexFollow follow(groom, kStride);
  const std::vector<glm::vec3> rest = rest_of(groom, kStrands);
  std::vector<glm::vec3> kept(follow.kept_size()), all(rest.size());
  follow.take(bent(groom), kept);
  // One strand that lies in one point.
  for (size_t k = 0; k < follow.kept().size(); ++k) kept[k * kStrands] = glm::vec3(0.1f);
  follow.follow(kept, all);
  for (size_t k = 0; k < follow.kept().size(); ++k)
    for (uint32_t s = 0; s < kStrands; ++s)
      ASSERT_EQ(all[size_t{follow.kept()[k]} * kStrands + s], kept[k * kStrands + s]);
  for (size_t k = 1; k < follow.kept().size(); ++k) {
    const size_t from = size_t{follow.kept()[k - 1]} * kStrands, to = size_t{follow.kept()[k]} * kStrands;
    for (size_t v = follow.kept()[k - 1] + 1; v < follow.kept()[k]; ++v)
      for (uint32_t s = 0; s < kStrands; ++s) {
        const size_t i = v * kStrands + s;
        const float whole = glm::distance(all[to + s], all[from + s]);
        const float rest_whole = glm::distance(rest[to + s], rest[from + s]);
        ASSERT_TRUE(std::isfinite(glm::length(all[i])));
        // A similar triangle.
        for (const size_t end : {from + s, to + s})
          ASSERT_NEAR(glm::distance(all[i], all[end]) * rest_whole, glm::distance(rest[i], rest[end]) * whole,
                      1e-5f * rest_whole * rest_whole)
              << s << " " << v;
      }
  }
}

TEST(VertexFollow, TakesWhatItPuts) {
  const Groom groom = grown();
  const VertexFollow follow(groom, kStride);
  const std::vector<glm::vec3> moved = bent(groom);
  std::vector<glm::vec3> kept(follow.kept_size()), again(kept.size()), all(moved.size(), glm::vec3(0.0f));
  follow.take(moved, kept);
  follow.blend(kept, all);
  follow.take(all, again);
  EXPECT_EQ(again, kept);
  for (uint32_t s = 0; s < kStrands; ++s) {
    const glm::vec3 mean = 0.5f * (moved[3 * kStrands + s] + moved[5 * kStrands + s]);
    ASSERT_LT(glm::distance(all[4 * kStrands + s], mean), 1e-6f);
  }
}

/// Some steps of a turning, moving head.
StepInput input_at(int step) {
  StepInput input;
  const double angle = 0.8 * std::sin(0.1 * step);
  input.world_from_head_rotation = glm::angleAxis(angle, glm::dvec3(0.0, 1.0, 0.0));
  input.head_shift_m = {0.004 * std::cos(0.07 * step), 0.0, 0.002};
  return input;
}

class FollowedSolvers : public testing::TestWithParam<SimDevice> {
 protected:
  std::unique_ptr<Solver> make(const char* name) {
    const SolverRow& row = **find_solver(name);
    SolverContext context;
    context.executor = &executors_.on(GetParam());
    auto solver = row.make(*complete_parameters(row, {}), context);
    EXPECT_TRUE(solver.ok());
    return std::move(*solver);
  }
  SimExecutors executors_;
};

INSTANTIATE_TEST_SUITE_P(Devices, FollowedSolvers, testing::ValuesIn(sim_devices()), name_of_device);

TEST_P(FollowedSolvers, GuidesMoveAsIfTheyWereAlone) {
  const Groom groom = grown();
  const glm::dquat upright(1.0, 0.0, 0.0, 0.0);
  auto alone = make("dftl");
  FollowedSolver followed(make("dftl"), {double{kGuides} / kStrands, 1});
  ASSERT_TRUE(alone->load(first_strands(groom, kGuides), upright));
  ASSERT_TRUE(followed.load(groom, upright));
  ASSERT_EQ(followed.guide_count(), kGuides);
  ASSERT_EQ(followed.strand_count(), kStrands);
  for (int step = 0; step < 30; ++step) {
    alone->substep(input_at(step));
    followed.substep(input_at(step));
  }
  SolverState a, b;
  alone->read(a);
  followed.read(b);
  for (uint32_t v = 0; v < kVertices; ++v)
    for (uint32_t s = 0; s < kGuides; ++s) {
      ASSERT_EQ(a.position_m[v * kGuides + s], b.position_m[v * kStrands + s]);
      ASSERT_EQ(a.velocity_mps[v * kGuides + s], b.velocity_mps[v * kStrands + s]);
    }
  const SolverBlocks blocks = followed.read_blocks();
  for (uint32_t s = 0; s < kStrands; ++s)
    for (uint32_t v = 0; v < kVertices; ++v)
      ASSERT_EQ(blocks.position_m.row(s / kBlockStrands, v, 1)[s % kBlockStrands],
                b.position_m[v * kStrands + s].y);
}

TEST_P(FollowedSolvers, VerticesThatAreSimulatedMoveAsIfTheyWereAlone) {
  const Groom groom = grown();
  const glm::dquat upright(1.0, 0.0, 0.0, 0.0);
  for (const double share : {1.0, double{kGuides} / kStrands}) {
    const SimulatedPart part{share, kStride};
    auto alone = make("direct_rod");
    FollowedSolver followed(make("direct_rod"), part);
    ASSERT_TRUE(alone->load(simulated_groom(groom, part), upright));
    ASSERT_TRUE(followed.load(groom, upright));
    const uint32_t count = followed.guide_count();
    ASSERT_EQ(count, guide_count(kStrands, share));
    ASSERT_EQ(followed.simulated_vertices(), 7u);
    SolverState a, b;
    for (int step = 0; step < 30; ++step) {
      alone->substep(input_at(step));
      followed.substep(input_at(step));
      if (step != 15) continue;
      // Handed over as from another level and back: what stands is taken up where it stands.
      followed.read(b);
      followed.write(b);
    }
    alone->read(a);
    followed.read(b);
    const std::vector<uint32_t> kept = VertexFollow(groom, kStride).kept();
    for (size_t k = 0; k < kept.size(); ++k)
      for (uint32_t s = 0; s < count; ++s) {
        const size_t of_all = size_t{kept[k]} * kStrands + s;
        ASSERT_LT(glm::distance(a.position_m[k * count + s], b.position_m[of_all]), 1e-4f) << k << " " << s;
      }
    // Of the strands that are simulated every length that the model keeps.
    for (uint32_t s = 0; s < count; ++s)
      for (uint32_t v = 1; v < kVertices; ++v) {
        const glm::vec3* rest = groom.rest_position_m.data() + groom.offset[s];
        const float length = glm::distance(rest[v], rest[v - 1]);
        const size_t i = size_t{v} * kStrands + s;
        ASSERT_NEAR(glm::distance(b.position_m[i], b.position_m[i - kStrands]), length, 2e-3f * length);
      }
  }
}

// What is told of the velocities is how they go on: seen from the head, positions differ by them.
TEST_P(FollowedSolvers, VelocitiesAreOfTheStrandsThatFollow) {
  const Groom groom = grown();
  FollowedSolver followed(make("dftl"), {double{kGuides} / kStrands, 1});
  ASSERT_TRUE(followed.load(groom, glm::dquat(1.0, 0.0, 0.0, 0.0)));
  constexpr double kShortStepS = 1.0 / 960.0;
  const auto step = [&](int i) {
    StepInput input;
    input.h_s = kShortStepS;
    input.world_from_head_rotation = glm::angleAxis(1.5 * i * kShortStepS, glm::dvec3(0.0, 1.0, 0.0));
    input.head_shift_m = glm::dvec3(0.6, 0.0, 0.2) * kShortStepS;
    followed.substep(input);
    return input.head_shift_m;
  };
  for (int i = 1; i <= 300; ++i) step(i);
  SolverState before, after;
  followed.read(before);
  const glm::vec3 shift_m(step(301));
  followed.read(after);
  double squares = 0.0, speeds = 0.0;
  for (size_t i = size_t{2} * kStrands; i < before.position_m.size(); ++i) {
    if (i % kStrands < kGuides) continue;
    const glm::vec3 moved = (after.position_m[i] + shift_m - before.position_m[i]) / float(kShortStepS);
    squares += glm::dot(moved - before.velocity_mps[i], moved - before.velocity_mps[i]);
    speeds += glm::dot(moved, moved);
  }
  EXPECT_LT(std::sqrt(squares / speeds), 0.1) << "of how fast they are";
}

TEST_P(FollowedSolvers, SeenFromTheHeadAJumpChangesNothing) {
  const Groom groom = grown();
  FollowedSolver followed(make("direct_rod"), {double{kGuides} / kStrands, 1});
  ASSERT_TRUE(followed.load(groom, glm::dquat(1.0, 0.0, 0.0, 0.0)));
  for (int step = 0; step < 5; ++step) followed.substep(input_at(step));
  const glm::dquat from = input_at(4).world_from_head_rotation;
  const glm::dquat to = glm::angleAxis(2.0, glm::normalize(glm::dvec3(1.0, 2.0, 0.5)));
  SolverState before, after;
  followed.read(before);
  followed.rebase(to);
  followed.read(after);
  for (size_t i = 0; i < before.position_m.size(); ++i) {
    const glm::dvec3 a = glm::conjugate(from) * glm::dvec3(before.position_m[i]);
    const glm::dvec3 b = glm::conjugate(to) * glm::dvec3(after.position_m[i]);
    ASSERT_LT(glm::distance(a, b), 1e-6) << i;
  }
}

TEST(HeadMotion, IsWhatMovesTheHeadFromOnePoseToTheOther) {
  const glm::dvec3 velocity(1.0, -2.0, 0.5), spin(0.3, 2.0, -0.4);
  constexpr double kPassedS = 0.05;
  Pose from;
  from.position_m = {5.0, 6.0, 7.0};
  from.rotation = glm::angleAxis(1.0, glm::normalize(glm::dvec3(1.0, 1.0, 0.0)));
  Pose to = from;
  to.position_m += kPassedS * velocity;
  to.rotation = -(glm::angleAxis(glm::length(spin) * kPassedS, glm::normalize(spin)) * from.rotation);
  const HeadMotion motion = head_motion(from, to, kPassedS);
  EXPECT_LT(glm::distance(motion.velocity_mps, velocity), 1e-9);
  EXPECT_LT(glm::distance(motion.spin_radps, spin), 1e-9) << "whichever sign the quaternion has";
  EXPECT_EQ(head_motion(from, from, kPassedS).spin_radps, glm::dvec3(0.0));
}

/// Farthest that a vertex comes in one step, seen from the head.
double step_and_measure(Solver& solver, const StepInput& input, const glm::dquat& before) {
  SolverState from, to;
  solver.read(from);
  solver.substep(input);
  solver.read(to);
  double largest_m = 0.0;
  for (size_t i = 0; i < from.position_m.size(); ++i) {
    const glm::dvec3 a = glm::conjugate(before) * glm::dvec3(from.position_m[i]);
    const glm::dvec3 b = glm::conjugate(input.world_from_head_rotation) * glm::dvec3(to.position_m[i]);
    largest_m = std::max(largest_m, glm::distance(a, b));
  }
  return largest_m;
}

// Hair lies in the airstream of a steady, turning flight. It falls asleep, the head flies on and turns, hair
// wakes: it lies there still. With the speeds that it fell asleep with, or none, the head would fly out from
// under it: 2 m/s are 33 mm a step.
TEST_P(FollowedSolvers, HairWakesAsFastAsTheHeadAndIsNotKicked) {
  const Groom groom = grown();
  constexpr double kSpeedMps = 2.0;
  for (const char* name : {"dftl", "direct_rod", "xpbd"}) {
    auto solver = make(name);
    ASSERT_TRUE(solver->load(groom, glm::dquat(1.0, 0.0, 0.0, 0.0)));
    StepInput input;
    input.head_shift_m = {kSpeedMps * input.h_s, 0.0, 0.0};
    for (int i = 0; i < 240; ++i) solver->substep(input);
    double awake_m = 0.0;
    for (int i = 0; i < 20; ++i)
      awake_m = std::max(awake_m, step_and_measure(*solver, input, input.world_from_head_rotation));
    // Asleep the flight has turned with the head, as far as the head can tell.
    const glm::dquat turned = glm::angleAxis(1.2, glm::dvec3(0.0, 1.0, 0.0));
    input.world_from_head_rotation = turned;
    input.head_shift_m = turned * input.head_shift_m;
    solver->rebase(turned);
    move_with_head(*solver, {input.head_shift_m / input.h_s, glm::dvec3(0.0)});
    double woken_m = 0.0;
    for (int i = 0; i < 20; ++i) woken_m = std::max(woken_m, step_and_measure(*solver, input, turned));
    EXPECT_LT(woken_m, awake_m + 0.05 * kSpeedMps * input.h_s) << name;
  }
}

}  // namespace
}  // namespace strandcast::strand_follow_test

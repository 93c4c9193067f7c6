// Limits of bending, after any model's kernel: angles are within them, lengths and all other directions are
// as they were, the groom is left alone, and double precision says the same.
#include "server/sim/bend_limit.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "server/report/crowded_hair.h"
#include "server/sim/executor/lanes_executor.h"
#include "server/sim/strand_state.h"
#include "tests/support/sim_devices.h"

namespace strandcast::bend_limit_test {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180.0;
constexpr double kRoundingDeg = 0.05;  // of positions of 0.3 m at both ends of segments of 13 mm

constexpr double kSlackDeg = 0.6;  // 1e-5 of a cosine of 1 degree

double angle_deg(const glm::dvec3& a, const glm::dvec3& b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)) / kDegree;
}

BendLimitDesc some_limits() {
  BendLimitDesc limits;
  limits.least_root_deg = 1.0;
  limits.least_tip_deg = 4.0;
  limits.most_root_deg = 10.0;
  limits.most_tip_deg = 40.0;
  return limits;
}

class BendLimitOn : public testing::TestWithParam<SimDevice> {
 protected:
  /// A tuft bent in all directions; the first vertices of some strands stay as groomed.
  void bend(float amount) {
    groom = make_tuft(61, 16, 0.2f, 3);
    strands.emplace(executor());
    ASSERT_TRUE(strands->load(groom, rotation));
    strands->read(state);
    std::mt19937 random(4);
    std::normal_distribution<float> normal;
    const uint32_t count = strands->layout().strand_count;
    for (size_t i = count; i < state.position_m.size(); ++i) {
      const size_t from = i - count;
      const glm::vec3 edge = rest_edge(i);
      const glm::vec3 bent =
          edge + amount * glm::length(edge) * glm::vec3(normal(random), normal(random), normal(random));
      state.position_m[i] = state.position_m[from] + glm::length(edge) * glm::normalize(bent);
      state.velocity_mps[i] = glm::vec3(normal(random), normal(random), normal(random));
    }
    strands->write(state);
  }
  glm::vec3 rest_edge(size_t i) const {
    const StrandLayout& layout = strands->layout();
    return glm::vec3(rotation *
                     (glm::dvec3(layout.rest[i]) - glm::dvec3(layout.rest[i - layout.strand_count])));
  }
  SolverState limited(const BendLimitDesc& limits) {
    auto limit = BendLimit::make(executor(), {}, strands->layout(), {}, limits);
    EXPECT_TRUE(limit) << limit.error().to_string();
    StepInput input;
    input.world_from_head_rotation = rotation;
    const StepBlock step = make_step_block(input, {}, strands->layout().counts(), strands->head());
    limit->run(step, strands->planes(), {});
    SolverState after;
    strands->read(after);
    return after;
  }
  /// Angles of a strand's joints, from the one at vertex 1 on.
  std::vector<double> angles_deg(const SolverState& of, uint32_t strand) const {
    const StrandLayout& layout = strands->layout();
    std::vector<double> angles;
    for (uint32_t v = 2; v < layout.vertex_count; ++v) {
      const auto at = [&](uint32_t vertex) {
        return glm::dvec3(of.position_m[layout.index(vertex, strand)]);
      };
      angles.push_back(angle_deg(at(v - 1) - at(v - 2), at(v) - at(v - 1)));
    }
    return angles;
  }
  Executor& executor() { return executors_.on(GetParam()); }

  static SimExecutors executors_;
  Groom groom;
  glm::dquat rotation = glm::normalize(glm::dquat(0.8, 0.1, -0.5, 0.2));
  std::optional<StrandState> strands;
  SolverState state;
};
SimExecutors BendLimitOn::executors_;

TEST_P(BendLimitOn, AnglesAreWithinTheLimitsAndLengthsAsTheyWere) {
  for (const float amount : {0.02f, 0.3f, 2.0f}) {
    bend(amount);
    const BendLimitDesc limits = some_limits();
    const SolverState after = limited(limits);
    const StrandLayout& layout = strands->layout();
    int turned = 0;
    for (uint32_t s = 0; s < layout.strand_count; ++s) {
      const std::vector<double> found = angles_deg(after, s);
      for (uint32_t v = 2; v < layout.vertex_count; ++v) {
        const size_t i = layout.index(v, s);
        const double arc = (v + 0.0) / (layout.vertex_count - 1);  // segments are equally long
        const double most = std::lerp(limits.most_root_deg, limits.most_tip_deg, arc);
        const double least = std::lerp(limits.least_root_deg, limits.least_tip_deg, arc);
        EXPECT_LE(found[v - 2], most + kRoundingDeg) << s << ' ' << v;
        EXPECT_GE(found[v - 2], least - kSlackDeg) << s << ' ' << v;
        const glm::dvec3 edge =
            glm::dvec3(after.position_m[i]) - glm::dvec3(after.position_m[i - layout.strand_count]);
        EXPECT_NEAR(glm::length(edge), static_cast<double>(layout.rest[i].w), 1e-7);
        turned += after.position_m[i] != state.position_m[i];
      }
    }
    EXPECT_GT(turned, 100);
  }
}

TEST_P(BendLimitOn, WhatIsWithinThemIsLeftAloneBitForBit) {
  bend(0.1f);
  BendLimitDesc wide;
  wide.most_root_deg = 170.0;
  wide.most_tip_deg = 175.0;
  const SolverState after = limited(wide);
  EXPECT_EQ(after.position_m, state.position_m);
  EXPECT_EQ(after.velocity_mps, state.velocity_mps);
}

TEST_P(BendLimitOn, DirectionsBeyondATurnStay) {
  bend(0.3f);
  const SolverState after = limited(some_limits());
  const StrandLayout& layout = strands->layout();
  for (uint32_t s = 0; s < layout.strand_count; ++s)
    for (uint32_t v = 2; v < layout.vertex_count; ++v) {
      const size_t i = layout.index(v, s);
      const size_t before = i - layout.strand_count;
      const glm::dvec3 was = glm::dvec3(state.position_m[i]) - glm::dvec3(state.position_m[before]);
      const glm::dvec3 is = glm::dvec3(after.position_m[i]) - glm::dvec3(after.position_m[before]);
      // Turned in the plane of both segments, or not at all.
      const glm::dvec3 base =
          glm::dvec3(after.position_m[before]) - glm::dvec3(after.position_m[before - layout.strand_count]);
      const glm::dvec3 plane = glm::cross(base, was);
      if (glm::length(plane) < 1e-2 * glm::length(base) * glm::length(was)) continue;
      EXPECT_NEAR(glm::dot(glm::normalize(plane), glm::normalize(is)), 0.0, 1e-3);
    }
}

TEST_P(BendLimitOn, TheGroomsOwnBendsAreAllowed) {
  groom = make_tuft(20, 12, 0.2f, 8);
  for (size_t i = 0; i < groom.rest_position_m.size(); ++i)
    if (i % 12 > 5) groom.rest_position_m[i].x += 0.02f * static_cast<float>(i % 12 - 5);
  strands.emplace(executor());
  ASSERT_TRUE(strands->load(groom, rotation));
  strands->read(state);
  BendLimitDesc narrow;
  narrow.most_root_deg = narrow.most_tip_deg = 2.0;
  const SolverState after = limited(narrow);
  EXPECT_EQ(after.position_m, state.position_m);
}

INSTANTIATE_TEST_SUITE_P(Devices, BendLimitOn, testing::ValuesIn(sim_devices()), name_of_device);

// Hair that hangs from the side of a head, held by limits of few degrees at its roots: it stands out further,
// and still comes to rest, with models that remember how they moved as well.
TEST(BendLimit, HairStandsAndRests) {
  auto executor = std::move(make_lanes_executor()).value();
  for (const char* solver : {"dftl", "direct_rod", "xpbd"}) {
    SCOPED_TRACE(solver);
    Groom groom = make_tuft(60, 12, 0.2f, 9);
    for (glm::vec3& point : groom.rest_position_m) point = {point.y, point.z, point.x};  // out to the side
    for (uint32_t s = 0; s < groom.strand_count(); ++s) groom.pinned[groom.offset[s] + 1] = 1;
    SceneDesc scene;
    scene.has_auto_collider = false;
    scene.follicle_limit_deg = 180.0;
    scene.solver = {solver, {}};
    for (const SolverParameterInfo& info : find_solver(solver).value()->parameters)
      if (info.name == "style_stiffness_per_s2" || info.name == "sag_free")
        scene.solver.parameters[info.name] = 0.0;
    const auto height_m = [&] {
      CrowdedHair hair = CrowdedHair::make(*executor, scene, groom, scene.volume.resolution).value();
      hair.shake(4.0);
      hair.hold(12.0);
      const RestFindings found = hair.look(2.0);
      EXPECT_LT(found.speed_rms_mps, 5e-4);
      return hair.mean_shift_m().y;
    };
    const double free_m = height_m();
    scene.bend_limit.most_root_deg = 4.0;
    scene.bend_limit.most_tip_deg = 8.0;
    const double held_m = height_m();
    EXPECT_GT(held_m, free_m + 0.01) << free_m << ' ' << held_m;
    EXPECT_LT(held_m, 0.0);
  }
}

}  // namespace
}  // namespace strandcast::bend_limit_test

// The real motion of work-precision and the runs it is made of; in double precision, without GL.
#include <cmath>

#include "server/report/motion_set.h"
#include "tests/support/shared_data.h"

namespace strandcast {
namespace {

RunSetting rod_setting(uint32_t vertex_count, double rate_hz) {
  RunSetting setting{*find_solver("direct_rod"), Material::Hair, vertex_count, rate_hz};
  setting.is_reference = true;
  return setting;
}

TEST(MotionSet, BeginsAtRestAndUpright) {
  const auto motion = MotionSet::make({});
  ASSERT_TRUE(motion);
  const Pose begin = motion->head_at(0.0);
  EXPECT_NEAR(angle_between_rad(begin.rotation, {1.0, 0.0, 0.0, 0.0}), 0.0, 1e-7);
  // The clock starts with a third power: after t the head has moved by less than its speed times t^4.
  constexpr double kStepS = 1e-3;
  EXPECT_LT(glm::distance(motion->head_at(kStepS).position_m, begin.position_m), 1e-8);
  EXPECT_LT(angle_between_rad(motion->head_at(kStepS).rotation, begin.rotation), 1e-7);
  // It moves later on, and nowhere jumps: the reference could not converge.
  double fastest_radps = 0.0;
  double largest_jump = 0.0;
  double before = 0.0;
  for (double t = 0.0; t < motion->duration_s(); t += kStepS) {
    const double speed =
        angle_between_rad(motion->head_at(t).rotation, motion->head_at(t + kStepS).rotation) / kStepS;
    largest_jump = std::max(largest_jump, std::abs(speed - before));
    fastest_radps = std::max(fastest_radps, speed);
    before = speed;
  }
  EXPECT_GT(fastest_radps, 5.0);
  EXPECT_LT(largest_jump, 0.05 * fastest_radps);
}

TEST(MotionSet, StrandsHangStraightWithTheirLength) {
  const auto motion = MotionSet::make({});
  const Groom groom = motion->groom(16, 5);
  ASSERT_TRUE(validate(groom));
  EXPECT_EQ(groom.strand_count(), 5u);
  for (uint32_t s = 0; s < 5; ++s) {
    EXPECT_NEAR(groom.length_m(s), MotionSet::kLengthM, 1e-6);
    const glm::vec3 way =
        groom.rest_position_m[groom.offset[s + 1] - 1] - groom.rest_position_m[groom.offset[s]];
    EXPECT_NEAR(way.y, -MotionSet::kLengthM, 1e-6);
  }
}

TEST(MotionSet, AllRatesSampleTheSameMotion) {
  const auto motion = MotionSet::make({{}, 0.2, 2});
  for (const double rate_hz : {30.0, 120.0}) {
    for (const uint32_t substeps : {1u, 3u}) {
      RunSetting setting = rod_setting(8, rate_hz);
      setting.substeps = substeps;
      glm::dvec3 way_m(0.0);
      double time_s = 0.0;
      const auto inputs = motion->inputs(setting, static_cast<int>(0.2 * rate_hz));
      for (const StepInput& input : inputs) {
        way_m += input.head_shift_m;
        time_s += input.h_s;
      }
      EXPECT_NEAR(time_s, 0.2, 1e-9);
      EXPECT_NEAR(glm::distance(way_m, motion->head_at(0.2).position_m - motion->head_at(0.0).position_m),
                  0.0, 1e-9);
      EXPECT_NEAR(angle_between_rad(inputs.back().world_from_head_rotation, motion->head_at(0.2).rotation),
                  0.0, 1e-6);
    }
  }
}

TEST(MotionSet, TheRodConvergesInTimeAndSpace) {
  const auto motion = MotionSet::make({{}, 0.6, 2});
  const auto exact = run_rod(*motion, 64, 1920.0);
  ASSERT_TRUE(exact);
  const auto error = [&](uint32_t vertex_count, double rate_hz) {
    const auto run = run_rod(*motion, vertex_count, rate_hz);
    EXPECT_TRUE(run);
    return relative_rms(*run, *exact);
  };
  const double coarse = error(64, 120.0);
  const double fine = error(64, 480.0);
  EXPECT_LE(fine, 0.25 * coarse) << "at least the first order";
  EXPECT_LE(error(32, 1920.0), 0.5 * error(16, 1920.0));
  EXPECT_LE(fine, 1e-3);
  EXPECT_EQ(relative_rms(*exact, *exact), 0.0);
}

Trajectory straight_trajectory(uint32_t vertex_count, const glm::vec3& begin, const glm::vec3& way) {
  Trajectory trajectory;
  trajectory.strand_count = 1;
  trajectory.vertex_count = vertex_count;
  trajectory.position_m.emplace_back();
  for (uint32_t i = 0; i < vertex_count; ++i)
    trajectory.position_m.back().push_back(begin + way * (static_cast<float>(i) / (vertex_count - 1)));
  return trajectory;
}

TEST(RelativeRms, ComparesAtTheSameShareOfTheArc) {
  const Trajectory fine = straight_trajectory(128, {0.1f, 0.0f, 0.0f}, {0.0f, -0.25f, 0.0f});
  const Trajectory coarse = straight_trajectory(8, {0.1f, 0.0f, 0.0f}, {0.0f, -0.25f, 0.0f});
  EXPECT_NEAR(relative_rms(coarse, fine), 0.0, 1e-6);
  // Moved by a tenth of the length: that is the error.
  const float off = 0.1f * static_cast<float>(MotionSet::kLengthM);
  const Trajectory moved = straight_trajectory(8, {0.1f + off, 0.0f, 0.0f}, {0.0f, -0.25f, 0.0f});
  EXPECT_NEAR(relative_rms(moved, fine), 0.1, 1e-5);
  Trajectory broken = moved;
  broken.is_finite = false;
  EXPECT_TRUE(std::isinf(relative_rms(broken, fine)));
}

TEST(RelativeRms, ComparesTheStrandsThatBothHave) {
  const auto motion = MotionSet::make({{}, 0.2, 4});
  const RunSetting setting = rod_setting(8, 60.0);
  const auto all = motion->run({}, setting);
  const auto two = motion->run({}, setting, 2);
  EXPECT_EQ(two->strand_count, 2u);
  EXPECT_EQ(relative_rms(*all, *two), 0.0);
  EXPECT_EQ(relative_rms(*two, *all), 0.0);
}

TEST(RelativeRms, InterpolatesCurvesToTheFourthOrder) {
  const auto arc = [](uint32_t vertex_count) {
    Trajectory trajectory = straight_trajectory(vertex_count, glm::vec3(0.0f), glm::vec3(0.0f));
    for (uint32_t i = 0; i < vertex_count; ++i) {
      const float angle = 2.0f * static_cast<float>(i) / (vertex_count - 1);
      trajectory.position_m[0][i] = 0.125f * glm::vec3(std::sin(angle), std::cos(angle), 0.0f);
    }
    return trajectory;
  };
  EXPECT_LT(relative_rms(arc(12), arc(128)), 1e-6);
  EXPECT_LT(relative_rms(arc(64), arc(17)), 1e-4);
}

TEST(MotionSet, RefusesAClipThatIsTooShort) {
  const auto missing = MotionSet::make({"/nowhere/walk.bvh", 1.0, 2});
  ASSERT_FALSE(missing);
  EXPECT_THAT(missing.error().to_string(), testing::HasSubstr("walk.bvh"));
}

// This clip is sampled 30 times a second; the head moves smoothly in between.
TEST(MotionSet, RealClipsAreSmooth) {
  const std::filesystem::path clip = std::filesystem::path(STRANDCAST_SHARED_DATA) / "mocap/fair1_dab.bvh";
  REQUIRE_SHARED(clip);
  const auto motion = MotionSet::make({clip, 2.0, 2});
  ASSERT_TRUE(motion) << motion.error().to_string();
  constexpr double kStepS = 1e-3;
  glm::dvec3 before(0.0);
  double fastest_mps = 0.0;
  double largest_jump_mps = 0.0;
  for (double t = 0.0; t < 2.0; t += kStepS) {
    const glm::dvec3 speed =
        (motion->head_at(t + kStepS).position_m - motion->head_at(t).position_m) / kStepS;
    largest_jump_mps = std::max(largest_jump_mps, glm::distance(speed, before));
    fastest_mps = std::max(fastest_mps, glm::length(speed));
    before = speed;
  }
  EXPECT_GT(fastest_mps, 0.1);
  EXPECT_LT(largest_jump_mps, 0.02 * fastest_mps);
}

TEST(StrandRun, LimpStrandsHang) {
  for (const char* name : {"dftl", "dftl_parallel", "ftl", "pbd", "xpbd", "direct_rod"})
    EXPECT_TRUE(can_be_limp(**find_solver(name))) << name;
}

TEST(StrandRun, ParametersAreTheMaterials) {
  RunPhysics physics;
  physics.given = {{"air_drag_per_s", 3.0}, {"no_such_parameter", 1.0}};
  RunSetting setting = rod_setting(16, 60.0);
  setting.effort = 2.0;
  const auto hair = run_parameters(setting, physics);
  ASSERT_TRUE(hair) << hair.error().to_string();
  EXPECT_EQ(hair->at("young_modulus_pa"), physics.hair.young_modulus_pa);
  EXPECT_EQ(hair->at("air_drag_per_s"), 3.0);
  EXPECT_EQ(hair->at("solves"), 2.0);
  EXPECT_FALSE(hair->contains("no_such_parameter"));
  setting.material = Material::Limp;
  EXPECT_EQ(run_parameters(setting, physics)->at("young_modulus_pa"), 0.0);
  physics.hair.young_modulus_pa = -1.0;
  setting.material = Material::Hair;
  EXPECT_FALSE(run_parameters(setting, physics));
}

TEST(StrandRun, EffortsStayWithinTheRow) {
  for (const SolverRow& row : solver_table()) {
    const std::vector<double> values = effort_values(row, {1e-3, 1.0, 1e3});
    if (row.effort_parameter.empty()) {
      EXPECT_TRUE(values.size() == 1 && std::isnan(values[0])) << row.name;
      continue;
    }
    EXPECT_TRUE(std::is_sorted(values.begin(), values.end()));
    for (const double value : values)
      EXPECT_TRUE(complete_parameters(row, {{row.effort_parameter, value}})) << row.name << " " << value;
  }
}

}  // namespace
}  // namespace strandcast

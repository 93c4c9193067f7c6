// The real motion of work-precision and the runs it is made of; in double precision, without GL.
#include <cmath>

#include "server/report/motion_set.h"
#include "server/report/work_precision.h"
#include "tests/support/claims.h"
#include "tests/support/shared_data.h"

namespace strandcast::motion_set_test {
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

// What the page says of the hair, in every material: in air that moves it more than a lock, and damped as
// direct_rod ships.
TEST(MotionSet, HairIsInAir) {
  const auto motion = MotionSet::make({});
  const SolverRow& rod = **find_solver("direct_rod");
  const SolverParameters shipped = *complete_parameters(rod, {});
  int rows_in_air = 0;
  for (const SolverRow& row : solver_table()) {
    if (!has_parameter(row, "air_drag_per_s")) continue;
    for (const Material material : {Material::Hair, Material::Limp, Material::AsShipped}) {
      const auto parameters = run_parameters({&row, material, 16, 240.0}, motion->physics());
      ASSERT_TRUE(parameters) << row.name << ": " << parameters.error().to_string();
      EXPECT_EQ(parameters->at("air_drag_per_s"), MotionSet::kAirDragPerS) << row.name;
    }
    ++rows_in_air;
  }
  EXPECT_GE(rows_in_air, 10);
  const auto rod_parameters = run_parameters({&rod, Material::Hair, 16, 60.0}, motion->physics());
  EXPECT_EQ(rod_parameters->at("bending_damping_s"), shipped.at("bending_damping_s"));
  EXPECT_LT(shipped.at("air_drag_per_s"), MotionSet::kAirDragPerS);
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
      // Poses are whole steps of 2^-32 (common/math/pose_lattice.h).
      const glm::dquat off =
          inputs.back().world_from_head_rotation * glm::conjugate(motion->head_at(0.2).rotation);
      EXPECT_NEAR(glm::length(glm::dvec3(off.x, off.y, off.z)), 0.0, 1e-9);
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

MotionSet motion_of(const MotionSetOptions& options) {
  auto motion = MotionSet::make(options);
  EXPECT_TRUE(motion) << motion.error().to_string();
  return std::move(motion).value();
}

TEST(MotionSet, HairOfEveryShapeHasItsLengthAndBeginsAtRest) {
  constexpr uint32_t kVertices = 64;
  double turn_rad[std::size(kMotionHairs)] = {};
  for (const MotionHair hair : kMotionHairs) {
    SCOPED_TRACE(to_string(hair));
    const MotionSet motion = motion_of({{}, MotionSet::kSampleS, 3, hair});
    const Groom groom = motion.groom(kVertices);
    ASSERT_TRUE(validate(groom));
    for (uint32_t s = 0; s < 3; ++s) EXPECT_NEAR(groom.length_m(s) / MotionSet::kLengthM, 1.0, 0.005);
    for (uint32_t i = 2; i < kVertices; ++i) {
      const glm::vec3* point = groom.rest_position_m.data() + i;
      turn_rad[static_cast<size_t>(hair)] += static_cast<double>(std::acos(std::min(
          1.0f, glm::dot(glm::normalize(point[0] - point[-1]), glm::normalize(point[-1] - point[-2])))));
    }
    // Nothing has set in yet: a full weight would have let it fall by 5 mm.
    const auto run = motion.run({}, rod_setting(kVertices, 240.0));
    ASSERT_TRUE(run) << run.error().to_string();
    for (uint32_t s = 0; s < 3; ++s)
      for (uint32_t i = 0; i < kVertices; ++i)
        EXPECT_LT(glm::distance(run->position_m[0][i * 3 + s], groom.rest_position_m[groom.offset[s] + i]),
                  1e-4f);
  }
  EXPECT_NEAR(turn_rad[0], 0.0, 0.02);
  EXPECT_NEAR(turn_rad[2], 100.0 / 180.0 * 3.14159, 0.05);
  EXPECT_GT(turn_rad[1], 5.0);
}

// Another model with another solver, as near as both have converged: what the converged rod is checked with.
TEST(MotionSet, AnotherModelAgreesWithTheConvergedRod) {
  for (const MotionHair hair : kMotionHairs) {
    const MotionSet motion = motion_of({{}, 0.6, 1, hair});
    const auto rod = run_rod(motion, 64, 1920.0);
    const auto other = run_in_double(motion, kCheckModel, 64, 1920.0);
    ASSERT_TRUE(rod && other);
    const double apart = relative_rms(*other, *rod);
    EXPECT_LE(apart, claims::kModelsApart) << to_string(hair);
    fmt::print("{} hair: {} is {:.4f} % of the length from the rod\n", to_string(hair), kCheckModel,
               100.0 * apart);
  }
}

TEST(MotionSet, HairOfEveryShapeConvergesOnAClip) {
  const std::filesystem::path clip = std::filesystem::path(STRANDCAST_SHARED_DATA) / "mocap/cmu_131_03.bvh";
  REQUIRE_SHARED(clip);
  for (const MotionHair hair : kMotionHairs) {
    const MotionSet motion = motion_of({clip, 0.4, 1, hair});
    const auto exact = run_rod(motion, 32, 1920.0);
    const auto coarse = run_rod(motion, 32, 120.0);
    const auto fine = run_rod(motion, 32, 480.0);
    const auto other = run_in_double(motion, kCheckModel, 32, 1920.0);
    ASSERT_TRUE(exact && coarse && fine && other);
    // At a quarter of the step of the first order at least, beside what is left of the finest one's error.
    EXPECT_LE(relative_rms(*fine, *exact), 0.3 * relative_rms(*coarse, *exact)) << to_string(hair);
    EXPECT_LE(relative_rms(*other, *exact), claims::kModelsApart) << to_string(hair);
    fmt::print("{} hair on a clip: {:.4f} % at 120 Hz, {:.4f} % at 480 Hz, {} {:.4f} %\n", to_string(hair),
               100.0 * relative_rms(*coarse, *exact), 100.0 * relative_rms(*fine, *exact), kCheckModel,
               100.0 * relative_rms(*other, *exact));
  }
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
}  // namespace strandcast::motion_set_test

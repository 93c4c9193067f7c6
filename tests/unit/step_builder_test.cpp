// What each substep gets: movement adds up, turns are shared out evenly, jumps move strands rigidly, and what
// the scene does not need is absent.
#include "server/scene/step_builder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "common/math/pose_lattice.h"

namespace strandcast::step_builder_test {
namespace {

SceneDesc still_scene() {
  SceneDesc scene = built_in_scene();
  scene.wind.mean_mps = glm::vec3(0.0f);
  scene.substeps = 4;
  return scene;
}

InputFrame moved(const glm::dvec3& position_m, double turn_rad) {
  InputFrame input;
  input.has_motion = true;
  input.world_from_head.position_m = position_m;
  input.world_from_head.rotation = glm::angleAxis(turn_rad, glm::dvec3(0.0, 1.0, 0.0));
  return input;
}

TEST(StepBuilder, SubstepsAddUpToTheHeadMovement) {
  const SceneDesc scene = still_scene();
  StepBuilder builder(scene, {});
  builder.build(moved({1000.0, 0.0, 0.0}, 0.0), {}, 0.0);
  const SceneStep& step = builder.build(moved({1000.1, 0.02, -0.03}, 0.4), {}, 1.0 / 60.0);
  ASSERT_EQ(step.substeps.size(), 4u);
  EXPECT_FALSE(step.carried_to_rotation.has_value());
  glm::dvec3 shift_m(0.0);
  double time_s = 0.0;
  for (size_t i = 0; i < 4; ++i) {
    shift_m += step.substeps[i].head_shift_m;
    time_s += step.substeps[i].h_s;
    const glm::dquat expected = glm::angleAxis(0.1 * static_cast<double>(i + 1), glm::dvec3(0.0, 1.0, 0.0));
    EXPECT_NEAR(angle_between_rad(step.substeps[i].world_from_head_rotation, expected), 0.0, 1e-7);
  }
  EXPECT_NEAR(glm::length(shift_m - glm::dvec3(0.1, 0.02, -0.03)), 0.0, 1e-9);
  EXPECT_NEAR(time_s, 1.0 / scene.step_rate_hz, 1e-12);
}

TEST(StepBuilder, TheHeadStandsAtItsPlaceAndMovesFromThere) {
  SceneDesc scene = still_scene();
  StepBuilder plain(scene, {});
  scene.place_m = {-3.0, 0.5, 7.0};
  StepBuilder builder(scene, {});
  EXPECT_EQ(builder.world_from_head().position_m, scene.place_m) << "before anything is heard";
  builder.build(InputFrame{}, {}, 0.0);
  EXPECT_EQ(builder.world_from_head().position_m, scene.place_m);
  plain.build(moved({1.0, 0.0, 0.0}, 0.2), {}, 0.0);
  builder.build(moved({1.0, 0.0, 0.0}, 0.2), {}, 0.0);
  const SceneStep there = builder.build(moved({1.125, 0.25, -0.5}, 0.4), {}, 1.0 / 60.0);
  const SceneStep here = plain.build(moved({1.125, 0.25, -0.5}, 0.4), {}, 1.0 / 60.0);
  EXPECT_EQ(there.world_from_head.position_m, here.world_from_head.position_m + scene.place_m);
  EXPECT_EQ(there.world_from_head.rotation, here.world_from_head.rotation);
  for (size_t i = 0; i < there.substeps.size(); ++i)
    EXPECT_EQ(there.substeps[i].head_shift_m, here.substeps[i].head_shift_m) << "strands feel nothing of it";
}

TEST(StepBuilder, JumpsAndTheFirstPoseMoveStrandsRigidly) {
  StepBuilder builder(still_scene(), {});
  const SceneStep& first = builder.build(moved({5.0, 0.0, 0.0}, 1.0), {}, 0.0);
  EXPECT_TRUE(first.carried_to_rotation.has_value());
  for (const StepInput& substep : first.substeps) EXPECT_EQ(substep.head_shift_m, glm::dvec3(0.0));
  InputFrame jump = moved({-50.0, 3.0, 0.0}, 2.5);
  jump.has_teleported = true;
  const SceneStep& second = builder.build(jump, {}, 0.0);
  EXPECT_TRUE(second.carried_to_rotation.has_value());
  for (const StepInput& substep : second.substeps) {
    EXPECT_EQ(substep.head_shift_m, glm::dvec3(0.0));
    EXPECT_NEAR(angle_between_rad(substep.world_from_head_rotation, jump.world_from_head.rotation), 0.0, 1e-7)
        << "the jump turns nothing within the step";
  }
}

/// A head that goes at a speed and from step 60 on at another, while `rate` steps of motion pass in a step.
struct Change {
  double before_mps, after_mps;
  bool is_cut = true;  // its source is, where the head jumps by 3 m
  double rate_before = 1.0, rate_after = 1.0;
};

/// The greatest acceleration that strands feel of it, m/s^2.
double most_felt_mps2(const Change& change) {
  SceneDesc scene = still_scene();
  scene.substeps = 1;
  StepBuilder builder(scene, {});
  const double h_s = 1.0 / scene.step_rate_hz;
  double most_mps2 = 0.0, x_m = 0.0;
  glm::dvec3 felt_mps(change.before_mps / change.rate_before, 0.0, 0.0);
  builder.begin(moved(glm::dvec3(0.0), 0.0), 0.0);
  for (int i = 1; i < 180; ++i) {
    const bool jumps = i == 60 && change.is_cut;
    const double rate = i < 60 ? change.rate_before : change.rate_after;
    x_m += jumps ? 3.0 : rate * h_s * (i < 60 ? change.before_mps : change.after_mps);
    InputFrame input = moved({x_m, 0.0, 0.0}, 0.0);
    input.has_teleported = jumps;
    builder.begin(input, 0.0, rate);
    const SceneStep& step = builder.step();
    EXPECT_EQ(step.world_from_head, rounded_pose(input.world_from_head)) << "the head is where it is";
    const glm::dvec3 mps = step.substeps[0].head_shift_m / h_s;
    most_mps2 = std::max(most_mps2, glm::length(mps - felt_mps) / h_s);
    felt_mps = mps;
  }
  EXPECT_NEAR(felt_mps.x, change.after_mps / change.rate_after, 1e-9) << "in the end all is felt";
  return most_mps2;
}

// A source that joins, comes back or leaves changes the head's speed at once. Strands feel the change over a
// second: 1.875 is a quintic's steepest slope. The same change of one source is felt as it is.
TEST(StepBuilder, ACutChangesTheFeltSpeedGently) {
  const double gently_mps2 = 1.01 * 1.875 * 2.3 / kFeltChangeS;
  EXPECT_LT(most_felt_mps2({0.0, 2.3}), gently_mps2) << "a head at rest";
  EXPECT_LT(most_felt_mps2({2.3, 0.0}), gently_mps2) << "a head that stops";
  EXPECT_LT(most_felt_mps2({2.3, 2.3}), 1e-6) << "a cut within a flight";
  EXPECT_GT(most_felt_mps2({0.0, 2.3, false}), 20.0 * gently_mps2);
}

// Of a head whose inputs pass twice as fast, strands feel half the speed. Where the pace changes at a cut,
// they go on at the speed that they felt, and come to the other over a second, as by the cut alone.
TEST(StepBuilder, ACutOfAHeadThatIsTooFastIsFeltOnce) {
  const double gently_mps2 = 1.01 * 1.875 * 0.5 * 2.3 / kFeltChangeS;
  EXPECT_LT(most_felt_mps2({0.0, 2.3, true, 2.0, 2.0}), gently_mps2) << "at one pace";
  EXPECT_LT(most_felt_mps2({2.3, 2.3, true, 2.0, 2.0}), 1e-6) << "a cut within a flight";
  EXPECT_LT(most_felt_mps2({2.3, 2.3, true, 1.0, 2.0}), gently_mps2) << "the simulation falls behind";
  EXPECT_LT(most_felt_mps2({2.3, 2.3, true, 2.0, 1.0}), gently_mps2) << "and comes back";
  EXPECT_GT(most_felt_mps2({2.3, 2.3, false, 1.0, 2.0}), 20.0 * gently_mps2) << "without a cut";
}

/// What the strands feel of a head that swings to and fro, when in each step `rate` steps of its motion pass:
/// its shift in the steps, and how it was carried.
struct Felt {
  std::vector<double> shift_m;
  int carried = 0;
};
constexpr double kSwingM = 0.1, kSwingRadPerS = 6.0;

Felt feel(double rate, double motion_speed) {
  SceneDesc scene = still_scene();
  scene.substeps = 1;
  StepBuilder builder(scene, {});
  Felt felt;
  for (int i = 0; i < 60; ++i) {
    const double t_s = i * rate * motion_speed / scene.step_rate_hz;
    InputFrame input = moved({kSwingM * std::sin(kSwingRadPerS * t_s), 0.0, 0.0}, 0.0);
    input.motion_speed = motion_speed;
    builder.begin(input, 0.0, rate);
    EXPECT_EQ(builder.step().world_from_head, rounded_pose(input.world_from_head))
        << "the head is where it is";
    felt.shift_m.push_back(builder.step().substeps[0].head_shift_m.x);
    felt.carried += builder.step().carried_to_rotation ? 1 : 0;
  }
  return felt;
}

// x = A sin(w t): the speed that is felt is 1 / rate of the head's, and changes `rate` times as fast.
TEST(StepBuilder, AHeadThatIsTooFastForTheSimulationIsFeltWithItsOwnAcceleration) {
  const double h_s = 1.0 / still_scene().step_rate_hz;
  for (const double rate : {1.0, 1.5, 2.5}) {
    const Felt felt = feel(rate, 1.0);
    for (size_t i = 2; i + 1 < felt.shift_m.size(); ++i) {
      const double acceleration_mps2 = (felt.shift_m[i + 1] - felt.shift_m[i]) / (h_s * h_s);
      const double t_s = static_cast<double>(i) * rate * h_s;
      const double expected_mps2 = -kSwingM * kSwingRadPerS * kSwingRadPerS * std::sin(kSwingRadPerS * t_s);
      EXPECT_NEAR(acceleration_mps2, expected_mps2, 0.02 * kSwingM * kSwingRadPerS * kSwingRadPerS) << rate;
    }
  }
}

TEST(StepBuilder, AHeadThatIsSlowedWithTheSimulationIsFeltAsItIs) {
  const Felt slowed = feel(4.0, 0.25);
  const Felt real = feel(1.0, 1.0);
  EXPECT_EQ(slowed.carried, 1) << "the first pose";
  for (size_t i = 0; i < real.shift_m.size(); ++i) EXPECT_NEAR(slowed.shift_m[i], real.shift_m[i], 1e-9);
  EXPECT_EQ(feel(4.0, 0.5).carried, 60) << "slowed, but not enough";
}

// Frames tell such poses in few bytes; what is off is less than the size of an atom.
TEST(StepBuilder, PlacesTheHeadOnTheLatticeOfPoses) {
  StepBuilder builder(still_scene(), {});
  const InputFrame input = moved({0.1, 1.0 / 3.0, -1234.567}, 0.3);
  EXPECT_FALSE(pose_steps(input.world_from_head));
  const Pose& pose = builder.build(input, {}, 0.0).world_from_head;
  EXPECT_TRUE(pose_steps(pose));
  EXPECT_LT(glm::distance(pose.position_m, input.world_from_head.position_m), 3e-10);
}

TEST(StepBuilder, WithoutMotionTheHeadStaysWhereItWas) {
  StepBuilder builder(still_scene(), {});
  builder.build(moved({1.0, 2.0, 3.0}, 0.5), {}, 0.0);
  InputFrame none;
  const SceneStep& step = builder.build(none, {}, 0.0);
  EXPECT_EQ(step.world_from_head.position_m, glm::dvec3(1.0, 2.0, 3.0));
  for (const StepInput& substep : step.substeps) EXPECT_EQ(substep.head_shift_m, glm::dvec3(0.0));
}

TEST(StepBuilder, TheGroomIsMadeUnderTheGravityThatTheSceneBeginsWith) {
  SceneDesc scene = still_scene();
  StepBuilder builder(scene, {});
  const SceneStep& tilted = builder.build(moved({0.0, 0.0, 0.0}, 1.5), {}, 0.0);
  for (const StepInput& substep : tilted.substeps)
    EXPECT_EQ(substep.groom_gravity_in_head_mps2, glm::dvec3(scene.gravity_mps2));
  const glm::dvec3 at_first = scene.gravity_mps2;
  scene.gravity_mps2 = {1.0, -3.0, 2.0};
  builder.change(scene, {});
  const SceneStep& step = builder.build(InputFrame{}, {}, 0.0);
  EXPECT_EQ(step.substeps[0].gravity_mps2, glm::dvec3(scene.gravity_mps2));
  EXPECT_EQ(step.substeps[0].groom_gravity_in_head_mps2, at_first);
}

TEST(StepBuilder, CollidersTurnWithTheHead) {
  StepBuilder builder(still_scene(), {{glm::vec3(0.0f, 0.0f, 0.1f), 0.09f}});
  const SceneStep& step = builder.build(moved({7.0, 0.0, 0.0}, std::numbers::pi / 2), {}, 0.0);
  ASSERT_EQ(step.substeps.back().colliders.size(), 1u);
  const SphereCollider& collider = step.substeps.back().colliders[0];
  EXPECT_NEAR(glm::length(collider.center_m - glm::vec3(0.1f, 0.0f, 0.0f)), 0.0f, 1e-6f);
  EXPECT_EQ(collider.radius_m, 0.09f);
}

TEST(StepBuilder, StreamReplacesSceneWindAndNoFactMeansNoWind) {
  SceneDesc scene = still_scene();
  scene.wind.mean_mps = {3.0f, 0.0f, 0.0f};
  scene.wind.gust_intensity = 0.5f;
  StepBuilder builder(scene, {});
  InputFrame input;
  const SceneStep& without = builder.build(input, SceneFeatures{}, 1.0);
  EXPECT_EQ(without.substeps[0].wind_mps, glm::dvec3(0.0));
  EXPECT_TRUE(without.substeps[0].gusts.empty());

  const SceneStep& with = builder.build(input, analyse(scene, {}), 1.0);
  EXPECT_GT(glm::length(with.substeps[0].wind_mps), 0.0);
  EXPECT_FALSE(with.substeps[0].gusts.empty());

  input.has_wind_stream = true;
  input.wind_mps = {0.0f, 0.0f, -4.0f};
  RuntimeFacts facts;
  facts.has_wind_stream = true;
  const SceneStep& streamed = builder.build(input, analyse(scene, facts), 1.0);
  EXPECT_EQ(streamed.substeps[0].wind_mps, glm::dvec3(0.0, 0.0, -4.0));
  EXPECT_TRUE(streamed.substeps[0].gusts.empty());
}

TEST(StepBuilder, GustWavesAreDivergenceFreeAndFixedInTheMovingAir) {
  WindDesc wind;
  wind.mean_mps = {2.0f, 0.0f, 1.0f};
  wind.gust_intensity = 0.4f;
  const std::vector<GustWave> waves = make_gust_waves(wind);
  ASSERT_FALSE(waves.empty());
  double variance = 0.0;
  for (const GustWave& wave : waves) {
    const double across = glm::dot(wave.amplitude_mps, wave.wave_vector_rad_per_m) /
                          (glm::length(wave.amplitude_mps) * glm::length(wave.wave_vector_rad_per_m));
    EXPECT_NEAR(across, 0.0, 1e-5);
    variance += 0.5 * glm::dot(wave.amplitude_mps, wave.amplitude_mps);
  }
  const double deviation_mps = glm::length(wind.mean_mps) * wind.gust_intensity;
  EXPECT_LT(variance, deviation_mps * deviation_mps) << "a part of the turbulence";

  // A head that drifts with the mean wind always meets the same waves.
  SceneDesc scene = still_scene();
  scene.wind = wind;
  scene.substeps = 1;
  StepBuilder builder(scene, {});
  const SceneFeatures features = analyse(scene, {});
  const auto phases_at = [&](double time_s) {
    const SceneStep& step = builder.build(moved(glm::dvec3(wind.mean_mps) * time_s, 0.0), features, time_s);
    std::vector<float> phases;
    for (const GustWave& wave : step.substeps[0].gusts) phases.push_back(wave.phase_rad);
    return phases;
  };
  const std::vector<float> before = phases_at(1.0);
  const std::vector<float> after = phases_at(21.7);
  for (size_t i = 0; i < before.size(); ++i)
    EXPECT_NEAR(std::remainder(after[i] - before[i], 2.0f * std::numbers::pi_v<float>), 0.0f, 1e-3f);
}

TEST(StepBuilder, TheSceneWindHasItsMean) {
  SceneDesc scene = still_scene();
  scene.wind.mean_mps = {0.9f, 0.1f, -1.2f};
  scene.wind.gust_intensity = 0.0f;
  StepBuilder builder(scene, {});
  for (const StepInput& substep : builder.build(InputFrame{}, analyse(scene, {}), 3.0).substeps)
    EXPECT_EQ(substep.wind_mps, glm::dvec3(scene.wind.mean_mps)) << "steady wind is its mean";
  // With gusts: within four standard errors of a process with the integral time length / speed.
  scene.wind.gust_intensity = 0.5f;
  scene.substeps = 1;
  builder.change(scene, {});
  constexpr double kStepS = 0.37, kDurationS = 20'000.0;
  glm::dvec3 sum_mps(0.0);
  uint32_t count = 0;
  for (double t_s = 0.0; t_s < kDurationS; t_s += kStepS, ++count)
    sum_mps += builder.build(InputFrame{}, analyse(scene, {}), t_s).substeps.back().wind_mps;
  const double speed_mps = glm::length(scene.wind.mean_mps);
  const double error_mps =
      4.0 * 0.5 * speed_mps * std::sqrt(2.0 * scene.wind.gust_length_m / speed_mps / kDurationS);
  EXPECT_NEAR(glm::distance(sum_mps / static_cast<double>(count), glm::dvec3(scene.wind.mean_mps)), 0.0,
              error_mps);
}

TEST(StepBuilder, GustWavesAreThoseOfTheirSeed) {
  WindDesc wind;
  wind.mean_mps = {2.0f, 0.0f, 1.0f};
  wind.gust_intensity = 0.4f;
  const auto waves_of = [&](uint32_t seed) {
    wind.seed = seed;
    return make_gust_waves(wind);
  };
  const std::vector<GustWave> first = waves_of(1), again = waves_of(1);
  ASSERT_EQ(first.size(), again.size());
  for (size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].wave_vector_rad_per_m, again[i].wave_vector_rad_per_m);
    EXPECT_EQ(first[i].amplitude_mps, again[i].amplitude_mps);
    EXPECT_EQ(first[i].phase_rad, again[i].phase_rad);
  }
  for (const uint32_t seed : {2u, 3u, 77u}) {
    const std::vector<GustWave> other = waves_of(seed);
    ASSERT_EQ(first.size(), other.size());
    for (size_t i = 0; i < first.size(); ++i) {
      // Two random directions are within 0.02 rad of each other once in 10,000 times.
      EXPECT_GT(glm::distance(glm::normalize(first[i].wave_vector_rad_per_m),
                              glm::normalize(other[i].wave_vector_rad_per_m)),
                0.02f)
          << seed;
      EXPECT_GT(glm::distance(glm::normalize(first[i].amplitude_mps), glm::normalize(other[i].amplitude_mps)),
                0.02f)
          << seed;
      EXPECT_NE(first[i].phase_rad, other[i].phase_rad) << seed;
      EXPECT_NEAR(glm::length(first[i].amplitude_mps), glm::length(other[i].amplitude_mps), 1e-6f)
          << "the spectrum is the same";
    }
  }
}

// Von Karman's spectrum of the along-wind component, 2 L / pi (1 + (1.339 k L)^2)^(-5/6) of the variance per
// wave number, integrated over wavelengths of 1.2 to 0.14 m. A sine has half the square of its amplitude.
TEST(StepBuilder, GustWavesHaveTheVarianceOfTheirWavelengths) {
  WindDesc wind;
  wind.mean_mps = {2.0f, 0.0f, 1.0f};
  wind.gust_intensity = 0.4f;
  const double length_m = wind.gust_length_m;
  constexpr int kParts = 10'000;
  const double lowest = 2.0 * std::numbers::pi / 1.2, highest = 2.0 * std::numbers::pi / 0.14;
  const double width = (highest - lowest) / kParts;
  double share = 0.0;
  for (int i = 0; i < kParts; ++i) {
    const double scaled = 1.339 * (lowest + (i + 0.5) * width) * length_m;
    share += width * 2.0 * length_m / std::numbers::pi * std::pow(1.0 + scaled * scaled, -5.0 / 6.0);
  }
  double variance = 0.0;
  for (const GustWave& wave : make_gust_waves(wind))
    variance += 0.5 * static_cast<double>(glm::dot(wave.amplitude_mps, wave.amplitude_mps));
  const double deviation_mps = static_cast<double>(glm::length(wind.mean_mps) * wind.gust_intensity);
  EXPECT_NEAR(variance / (deviation_mps * deviation_mps * share), 1.0, 0.02);
}

TEST(StepBuilder, GustWavesVanishWithoutWind) {
  WindDesc wind;
  EXPECT_TRUE(make_gust_waves(wind).empty());
  wind.mean_mps = {1.0f, 0.0f, 0.0f};
  EXPECT_TRUE(make_gust_waves(wind).empty()) << "steady";
}

TEST(StepBuilder, ShoulderMovesWithinTheStepAndIsNewWhereItJumps) {
  SceneDesc scene = still_scene();
  scene.body.capsules.resize(2);
  scene.body.capsules[0].from_joint = "a";
  scene.body.capsules[0].to_joint = "b";
  scene.body.capsules[1].from_joint = "c";
  scene.body.joint_offset_m = {0.0, -0.1, 0.0};
  scene.body.planes.resize(1);
  scene.body.planes[0].normal = {0.0, 2.0, 0.0};
  scene.body.planes[0].velocity_mps = {1.0, 5.0, 0.0};
  SceneFeatures features;
  features.has_body = true;
  StepBuilder builder(scene, {});
  const auto at = [](double y_m) {
    InputFrame input = moved(glm::dvec3(0.0), 0.0);
    input.joints = {{"a", "b"}, {{0.0, y_m, 0.0}, {1.0, y_m, 0.0}}};
    return input;
  };
  builder.build(at(0.0), features, 0.0);
  EXPECT_TRUE(builder.step().substeps[0].body.is_new);
  EXPECT_EQ(builder.missing_joints(),
            std::vector<std::string>{
                "body.capsules.1.from_joint: the motion stream has no joint \"c\" (it has a, b)"});
  builder.build(at(0.037), features, 1.0 / 60.0);
  double y_m = -0.1;
  for (const StepInput& substep : builder.step().substeps) {
    const BodyInput& body = substep.body;
    ASSERT_EQ(body.capsules.size(), 1u);
    EXPECT_FALSE(body.is_new);
    EXPECT_NEAR(body.capsules[0].from_before_m.y, y_m, 1e-12);
    y_m += 0.037 / 4.0;
    EXPECT_NEAR(body.capsules[0].to_m.y, y_m, 1e-12) << "a fourth of the way in each of four substeps";
    ASSERT_EQ(body.planes.size(), 1u);
    EXPECT_EQ(body.planes[0].normal, glm::dvec3(0.0, 1.0, 0.0));
    EXPECT_NEAR(glm::distance(body.planes[0].shift_m, glm::dvec3(1.0 / 240.0, 0.0, 0.0)), 0.0, 1e-12)
        << "along the surface only";
  }
  InputFrame jump = at(0.5);
  jump.has_teleported = true;
  builder.build(jump, features, 2.0 / 60.0);
  EXPECT_TRUE(builder.step().substeps[0].body.is_new);
  EXPECT_FALSE(builder.step().substeps[1].body.is_new);
  EXPECT_EQ(builder.step().substeps[0].body.capsules[0].from_before_m,
            builder.step().substeps[3].body.capsules[0].from_m);
  scene.body.friction = 0.9;
  builder.change(scene, {});
  builder.build(at(0.5), features, 3.0 / 60.0);
  EXPECT_FALSE(builder.step().substeps[0].body.is_new) << "the same shapes";
  scene.body.capsules[0].from_radius_m = 0.2;
  builder.change(scene, {});
  builder.build(at(0.5), features, 4.0 / 60.0);
  EXPECT_TRUE(builder.step().substeps[0].body.is_new);
}

}  // namespace
}  // namespace strandcast::step_builder_test

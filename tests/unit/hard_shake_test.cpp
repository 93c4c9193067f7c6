// A head that is shaken as hard as a neck can: no strand is flung about, as real hair in air is not.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "common/scene/scene_file.h"
#include "server/report/crowded_hair.h"
#include "server/scene/scene_content.h"
#include "server/sim/executor/executor.h"

namespace strandcast::hard_shake_test {
namespace {

constexpr double kAmplitudeRad = 55.0 * std::numbers::pi / 180.0;
// The fastest point of the scalp, 0.1 m from the axis, is accelerated by 10 g.
constexpr double kShakeHz = 4.92;
constexpr double kSetInS = 0.5, kShakeS = 2.5, kSeenFromS = 1.0;

Pose shaken(double t_s) {
  Pose pose;
  pose.rotation = glm::angleAxis(
      kAmplitudeRad * std::min(1.0, t_s / kSetInS) * std::sin(2.0 * std::numbers::pi * kShakeHz * t_s),
      glm::dvec3(0.0, 1.0, 0.0));
  return pose;
}

/// The fastest free vertex over the fastest root, both in the world.
double fastest_over_scalp(const std::vector<std::string>& overrides) {
  std::vector<std::string> all{"groom.procedural.strand_count=500", "solver.name=direct_rod"};
  all.insert(all.end(), overrides.begin(), overrides.end());
  SceneDesc scene = built_in_scene_with(all).value();
  scene.wind = {};
  const auto executor = open_executor({"lanes", "auto", {}}).value();
  HairRun run = HairRun::make(*executor, scene, load_scene_content(scene).value()).value();
  const size_t strand_count = run.layout().strand_count;
  double fastest_mps = 0.0, scalp_mps = 0.0;
  std::vector<glm::dvec3> before;
  while (run.time_s() < kShakeS) {
    const Pose pose = shaken(run.time_s() + 1.0 / scene.step_rate_hz);
    run.step(pose);
    std::vector<glm::dvec3> now;
    for (const glm::vec3& place : run.position_in_head_m()) now.push_back(pose * glm::dvec3(place));
    for (size_t i = 0; run.time_s() > kSeenFromS && i < now.size(); ++i) {
      double& most_mps = i < strand_count ? scalp_mps : fastest_mps;
      most_mps = std::max(most_mps, scene.step_rate_hz * glm::distance(now[i], before[i]));
    }
    before = std::move(now);
  }
  return fastest_mps / scalp_mps;
}

// A tip two head radii from the axis that turns with the head is twice as fast as the scalp: hair lags behind
// and is braked by air, so it stays below. The counter-example: without air it is cracked like a whip.
TEST(HardShake, NoStrandIsTwiceAsFastAsTheScalp) {
  EXPECT_LT(fastest_over_scalp({}), 2.0);
  EXPECT_GT(fastest_over_scalp({"air.acts=false"}), 2.5);
}

}  // namespace
}  // namespace strandcast::hard_shake_test

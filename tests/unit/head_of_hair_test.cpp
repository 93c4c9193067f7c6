// The built-in head of hair in full quality, all of it: it rests as it was groomed, keeps its shape in
// a light breeze, and comes back after a shake. Fast quality keeps to its head on a walk.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <memory>
#include <string>
#include <vector>

#include "common/motion/motion_clip.h"
#include "common/scene/scene_file.h"
#include "server/report/coherence_study.h"
#include "server/report/crowded_hair.h"
#include "tests/support/test_grid.h"

namespace strandcast::head_of_hair_test {
namespace {

constexpr double kMm = 1e-3;

/// How far from the groom.
struct Off {
  double rms_m = 0.0;
  double off_share = 0.0;  // of the strands: those that are further off than 2 mm rms
};

class HeadOfHair : public testing::Test {
 protected:
  HairRun run_of(const std::vector<std::string>& overrides) {
    std::vector<std::string> all = {"quality=full"};
    if (test_grid() == TestGrid::Small) all.emplace_back("groom.procedural.strand_count=500");
    all.insert(all.end(), overrides.begin(), overrides.end());
    const SceneDesc scene = built_in_scene_with(all).value();
    return HairRun::make(*executor_, scene, load_scene_content(scene).value()).value();
  }
  static HairRun& go(HairRun& run, double seconds, double shake_s = 0.0) {
    const double rate_hz = run.scene().step_rate_hz;
    for (int64_t i = 0; i < std::llround(seconds * rate_hz); ++i)
      run.step(yawed_head(run.time_s() + 1.0 / rate_hz, shake_s));
    return run;
  }
  static Off off(const HairRun& run, const std::vector<glm::dvec3>& position_m) {
    const StrandLayout& layout = run.layout();
    std::vector<double> of_strand_m2(layout.strand_count, 0.0);
    double sum_m2 = 0.0;
    for (size_t i = 0; i < position_m.size(); ++i) {
      const glm::dvec3 way_m = position_m[i] - glm::dvec3(layout.rest[i]);
      of_strand_m2[i % layout.strand_count] += glm::dot(way_m, way_m) / layout.vertex_count;
      sum_m2 += glm::dot(way_m, way_m);
    }
    const auto count = std::ranges::count_if(of_strand_m2, [](double m2) { return m2 > 4.0 * kMm * kMm; });
    return {std::sqrt(sum_m2 / static_cast<double>(position_m.size())),
            static_cast<double>(count) / layout.strand_count};
  }
  static Off off(const HairRun& run) {
    return off(run, {run.position_in_head_m().begin(), run.position_in_head_m().end()});
  }
  static std::vector<std::string> still_air() {
    return {"wind.mean_mps={ x: 0 z: 0 }", "wind.gust_intensity=0"};
  }

  std::unique_ptr<Executor> executor_ = open_executor({"lanes", "auto", {}}).value();
};

TEST_F(HeadOfHair, RestsInStillAirAsItWasGroomed) {
  HairRun run = run_of(still_air());
  EXPECT_LE(off(go(run, 20.0)).rms_m, 1.0 * kMm);
}

// Gusts come and go; what they leave on the mean is no other style.
TEST_F(HeadOfHair, KeepsItsShapeInALightBreeze) {
  const auto mean_off_m = [&](const std::vector<std::string>& overrides) {
    HairRun run = run_of(overrides);
    go(run, 10.0);
    std::vector<glm::dvec3> mean_m(run.layout().size(), glm::dvec3(0.0));
    constexpr int kMoments = 600;
    for (int i = 0; i < kMoments; ++i) {
      go(run, 1.0 / run.scene().step_rate_hz);
      for (size_t v = 0; v < mean_m.size(); ++v)
        mean_m[v] += glm::dvec3(run.position_in_head_m()[v]) / static_cast<double>(kMoments);
    }
    return off(run, mean_m).rms_m;
  };
  const double breeze_m = mean_off_m({"wind.mean_mps={ x: 0.54 z: -0.72 }"});  // 0.9 m/s
  EXPECT_LE(breeze_m, 8.0 * kMm);
  EXPECT_GE(breeze_m, 1.0 * kMm) << "it is seen";
}

// What pushes hair apart at the groom's own density holds it where it was thrown. What is left are locks that
// fell over a shoulder and lie on it.
TEST_F(HeadOfHair, ComesBackAfterAShake) {
  const auto left = [&](const std::vector<std::string>& more) {
    std::vector<std::string> overrides = still_air();
    overrides.insert(overrides.end(), more.begin(), more.end());
    HairRun run = run_of(overrides);
    constexpr double kShakeS = 4.0;
    return off(go(run, kShakeS + 9.0, kShakeS));
  };
  const Off found = left({});
  EXPECT_LE(found.rms_m, 7.0 * kMm);
  EXPECT_LE(found.off_share, 0.015);
  EXPECT_GE(left({"volume.rest_density_scale=1"}).off_share, 0.05) << "at the groom's own density";
}

// Without air a limp style swings further with each step of a walk, until locks stand up beside the parting.
TEST_F(HeadOfHair, FastQualityStandsUpNoMoreThanFullOnAWalk) {
  constexpr int kBegin = 120, kEnd = 480;         // steps
  constexpr uint32_t kFirstRow = 3, kEndRow = 7;  // vertices over the skull
  const auto near_off_m = [&](std::vector<std::string> overrides) {
    const std::vector<std::string> air = still_air();
    overrides.insert(overrides.end(), air.begin(), air.end());
    HairRun run = run_of(overrides);
    const size_t first = kFirstRow * run.layout().strand_count, end = kEndRow * run.layout().strand_count;
    double sum_m = 0.0;
    for (int step = 1; step <= kEnd; ++step) {
      run.step(built_in_motion(step / run.scene().step_rate_hz));
      if (step <= kBegin) continue;
      double sum_m2 = 0.0;
      for (size_t v = first; v < end; ++v) {
        const glm::dvec3 way_m = glm::dvec3(run.position_in_head_m()[v]) - glm::dvec3(run.layout().rest[v]);
        sum_m2 += glm::dot(way_m, way_m);
      }
      sum_m += std::sqrt(sum_m2 / static_cast<double>(end - first));
    }
    return sum_m / (kEnd - kBegin);
  };
  const double full_m = near_off_m({});
  EXPECT_LE(near_off_m({"quality=fast"}), full_m);
  EXPECT_GE(near_off_m({"quality=fast", "solver.parameters.style_stiffness_per_s2=400",
                        "solver.parameters.style_tip_share=0.25", "solver.parameters.thrust_share=1"}),
            1.4 * full_m)
      << "the model's own style";
}

}  // namespace
}  // namespace strandcast::head_of_hair_test

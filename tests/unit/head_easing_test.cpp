// What is shown of a head across its source's silence: it slows and comes back no harder than an easy start.
#include "server/input/head_easing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "common/math/turn.h"

namespace strandcast::head_easing_test {
namespace {

constexpr double kFrameS = 1.0 / 60.0;
// Between frames an acceleration shows exactly; turns by vectors are so but for their curvature.
constexpr double kRounding = 1.001, kCurvature = 1.1;

/// Where a head is at a time; nothing while its source is silent.
using Source = std::function<std::optional<Pose>(double t_s)>;

/// Frames of a head that is eased, or held where it was seen last.
std::vector<Pose> shown(const Source& source, double until_s, bool is_eased = true) {
  HeadEasing easing;
  std::vector<Pose> poses{*source(0.0)};
  easing.restart(poses.front());
  int heard = 0;
  for (int i = 1; i * kFrameS < until_s; ++i) {
    const std::optional<Pose> seen = source(i * kFrameS);
    const Pose eased = seen ? easing.follow(*seen, (i - heard) * kFrameS, kFrameS) : easing.coast(kFrameS);
    if (seen) heard = i;
    poses.push_back(is_eased ? eased : seen.value_or(poses.back()));
  }
  // The first frame has no speed before it.
  poses.erase(poses.begin());
  return poses;
}

/// A head that goes and turns evenly, and is not heard of between two times.
Source even_head(double mps, double rad_per_s, double silent_from_s, double silent_until_s) {
  return [=](double t_s) -> std::optional<Pose> {
    if (t_s > silent_from_s && t_s < silent_until_s) return std::nullopt;
    return Pose{{mps * t_s, 0.0, 0.5 * mps * t_s},
                glm::angleAxis(rad_per_s * t_s, glm::normalize(glm::dvec3(0.2, 1.0, 0.0)))};
  };
}

TEST(HeadEasing, ASilentHeadSlowsEvenlyAndRests) {
  const double mps = 1.2, rad_per_s = 5.0, silent_s = 1.0;
  const Source source = even_head(mps, rad_per_s, silent_s, 9.0);
  const std::vector<Pose> poses = shown(source, 3.0);
  const MotionPeaks peaks = peaks_of(poses, kFrameS);
  EXPECT_LE(peaks.mps2, kRounding * kEasyStart.mps2);
  EXPECT_LE(peaks.rad_per_s2, kRounding * kEasyStart.rad_per_s2);
  // A speed that shrinks evenly goes half as far. Both parts are slow enough for the shortest time.
  const Pose last = *source(silent_s), &rest = poses.back();
  const double on_s = 0.5 * kShortestEasingS;
  EXPECT_NEAR(rest.position_m.x - last.position_m.x, mps * on_s, 1e-9);
  EXPECT_NEAR(rest.position_m.z - last.position_m.z, 0.5 * mps * on_s, 1e-9);
  EXPECT_NEAR(angle_between_rad(last.rotation, rest.rotation), rad_per_s * on_s, 1e-6);
  const auto frame_at = [](double t_s) { return static_cast<size_t>(t_s / kFrameS); };
  EXPECT_EQ(poses[frame_at(silent_s + kShortestEasingS) + 1], rest) << "at rest after that time";
  EXPECT_NE(poses[frame_at(silent_s + kShortestEasingS) - 2], rest) << "and not before";
  const MotionPeaks held = peaks_of(shown(source, 3.0, false), kFrameS);
  EXPECT_GT(held.mps2, 10.0 * kEasyStart.mps2);
  EXPECT_GT(held.rad_per_s2, 10.0 * kEasyStart.rad_per_s2);
}

TEST(HeadEasing, AFasterHeadTakesLongerUpToABound) {
  for (const double mps : {1.8, 2.2}) {
    const MotionPeaks peaks = peaks_of(shown(even_head(mps, 4.0 * mps, 1.0, 9.0), 3.0), kFrameS);
    EXPECT_LE(peaks.mps2, kRounding * kEasyStart.mps2) << mps;
    EXPECT_LE(peaks.rad_per_s2, kRounding * kEasyStart.rad_per_s2) << mps;
  }
  const double runs_mps = 8.0;
  const std::vector<Pose> poses = shown(even_head(runs_mps, 0.0, 1.0, 9.0), 3.0);
  EXPECT_NEAR(poses.back().position_m.x - runs_mps, 0.5 * kLongestSlowingS * runs_mps, 1e-9);
}

// Beyond the source's own motion, which is even here, coming back is as easy, after a late sample as after
// long.
TEST(HeadEasing, AHeadThatIsHeardOfAgainComesBackWithoutAJump) {
  for (const double silent_s : {0.03, 0.1, 0.4, 1.5}) {
    SCOPED_TRACE(silent_s);
    const Source source = even_head(1.0, 0.8, 1.0, 1.0 + silent_s);
    const std::vector<Pose> poses = shown(source, 8.0);
    const MotionPeaks peaks = peaks_of(poses, kFrameS);
    EXPECT_LE(peaks.mps2, kRounding * kEasyStart.mps2);
    EXPECT_LE(peaks.rad_per_s2, kCurvature * kEasyStart.rad_per_s2);
    EXPECT_EQ(poses.back(), *source(static_cast<double>(poses.size()) * kFrameS)) << "it is where it is seen";
    EXPECT_GT(peaks_of(shown(source, 8.0, false), kFrameS).mps2, 10.0 * kEasyStart.mps2);
  }
}

// Silence and samples by turns: the head goes on, behind by no more than it goes from sample to sample.
TEST(HeadEasing, AHeadThatIsHeardOfNowAndThenKeepsUp) {
  const Source even = even_head(1.0, 0.8, 99.0, 99.0);
  const Source rare = [&](double t_s) -> std::optional<Pose> {
    const int frame = static_cast<int>(t_s / kFrameS + 0.5);
    if (frame > 60 && frame < 240 && frame % 4 != 0) return std::nullopt;
    return even(t_s);
  };
  const std::vector<Pose> poses = shown(rare, 5.0);
  EXPECT_LE(peaks_of(poses, kFrameS).mps2, kRounding * kEasyStart.mps2);
  const double from_sample_to_sample_m = 4.0 * kFrameS * std::hypot(1.0, 0.5);
  for (size_t i = 0; i < poses.size(); ++i) {
    const Pose seen = *even(static_cast<double>(i + 1) * kFrameS);
    EXPECT_NEAR(glm::distance(poses[i].position_m, seen.position_m), 0.0, from_sample_to_sample_m) << i;
  }
  EXPECT_GT(peaks_of(shown(rare, 5.0, false), kFrameS).mps2, 10.0 * kEasyStart.mps2);
}

TEST(HeadEasing, AHeadThatIsAlwaysSeenIsShownAsItIs) {
  HeadEasing easing;
  easing.restart({});
  EXPECT_FALSE(easing.knows_speed());
  for (int i = 1; i < 200; ++i) {
    const Pose seen{{0.1 * i * i, -0.0, 3.0}, glm::angleAxis(0.3 * i, glm::dvec3(0.0, 1.0, 0.0))};
    EXPECT_EQ(easing.follow(seen, kFrameS, i % 3 ? kFrameS : 0.0), seen);
  }
  EXPECT_TRUE(easing.knows_speed());
  const Pose elsewhere{{7.0, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}};
  easing.restart(elsewhere);
  EXPECT_EQ(easing.coast(kFrameS), elsewhere) << "a jump leaves no speed";
  EXPECT_EQ(easing.coast(0.0), elsewhere);
}

}  // namespace
}  // namespace strandcast::head_easing_test

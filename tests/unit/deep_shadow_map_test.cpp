// The deep shadow map in double precision against sums that can be written down, and the frame that it lies
// in.

#include "common/render/shadow/deep_shadow_map.h"

#include <cmath>
#include <random>

namespace strandcast::deep_shadow_map_test {
namespace {

using testing::IsEmpty;

const glm::vec3 kToLight(0.0f, 0.0f, 1.0f);
constexpr float kTexelM = 1e-3f;

LightFrame frame_of(const std::vector<glm::vec3>& points) {
  return fit_light_frame(points, kToLight, 64, 0.002f);
}

/// A line along y at x, so far from the light.
std::vector<ExpandedVertex> line(float x, float depth_m) {
  return {{{x, -0.02f, -depth_m}, 0.0f, {0, 1, 0}, 0}, {{x, 0.02f, -depth_m}, 0.0f, {0, 1, 0}, 0}};
}

const std::vector<glm::vec3> kBox{{-0.025f, -0.025f, 0.0f}, {0.025f, 0.025f, -0.05f}};

TEST(LightFrame, HoldsAllPointsThatAreNumbers) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> place(-0.2f, 0.2f);
  std::vector<glm::vec3> points;
  for (int i = 0; i < 200; ++i) points.emplace_back(place(random), place(random), place(random));
  points.emplace_back(std::nanf(""), 0.0f, 0.0f);
  points.emplace_back(1e20f, 0.0f, 0.0f);
  for (const glm::vec3 to_light : {glm::vec3(0, 0, 1), glm::vec3(0, 1, 0), glm::vec3(0.6f, -0.8f, 0.0f)}) {
    const LightFrame frame = fit_light_frame(points, to_light, 128, 0.01f);
    EXPECT_GT(frame.texels_per_m, 128.0f / 0.8f) << "and nothing else";
    for (size_t i = 0; i < 200; ++i) {
      const glm::vec3 at = frame.in_map(points[i]);
      for (int axis = 0; axis < 2; ++axis) {
        EXPECT_GE(at[axis], 0.0f);
        EXPECT_LE(at[axis], 128.0f);
      }
      EXPECT_GE(at.z, 0.0099f);
      EXPECT_LE(at.z, frame.depth_m - 0.0099f);
      // Farther along the light's way is deeper, metre for metre; lengths across are in texels.
      EXPECT_NEAR(frame.in_map(points[i] - 0.01f * to_light).z, at.z + 0.01f, 1e-5);
      EXPECT_NEAR(glm::length(glm::vec2(frame.in_map(points[i] + glm::vec3(0.01f)) - at)),
                  frame.texels_per_m * glm::length(glm::cross(glm::vec3(0.01f), to_light)), 1e-2);
    }
  }
}

TEST(LightFrame, StaysWhereItIsWhileHairMovesALittle) {
  const LightFrame before = frame_of(kBox);
  std::vector<glm::vec3> moved = kBox;
  for (glm::vec3& point : moved) point.x += 0.2f / before.texels_per_m;
  const LightFrame after = frame_of(moved);
  EXPECT_EQ(before.texels_per_m, after.texels_per_m);
  const glm::vec2 shift = before.in_map({}) - after.in_map({});
  EXPECT_EQ(shift, glm::round(shift)) << "by whole texels only";
}

TEST(DeepShadowMap, GrowsByEveryStrandThatIsCrossed) {
  const LightFrame frame = frame_of(kBox);
  DeepShadowMap map(frame, 0.3);
  for (const float depth_m : {0.03f, 0.01f, 0.02f}) map.add(line(0.0f, depth_m), 0.01, 1.0);
  map.finish();
  EXPECT_EQ(map.optical_depth({0.0f, 0.0f, -0.005f}), 0.0);
  EXPECT_NEAR(map.optical_depth({0.0f, 0.0f, -0.015f}), 0.3, 1e-12);
  EXPECT_NEAR(map.optical_depth({0.0f, 0.0f, -0.025f}), 0.6, 1e-12);
  EXPECT_NEAR(map.optical_depth({0.0f, 0.0f, -0.04f}), 0.9, 1e-12);
  EXPECT_EQ(map.optical_depth({0.015f, 0.0f, -0.04f}), 0.0) << "beside them";
}

TEST(DeepShadowMap, AStrandTakesItsWidthHoweverThin) {
  // Summed over a row of texels: width in texels times opacity, at any place within a texel.
  for (const double width_m : {0.05e-3, 0.3e-3, 2.2e-3})
    for (const float offset_m : {0.0f, 0.1e-3f, 0.37e-3f, 0.8e-3f}) {
      const LightFrame frame = frame_of(kBox);
      DeepShadowMap map(frame, 0.5);
      map.add(line(offset_m, 0.01f), width_m, 1.0);
      map.finish();
      double sum = 0.0;
      for (uint32_t x = 0; x < frame.texels; ++x)
        for (const ShadowStep& step : map.steps(x, frame.texels / 2, 0.0)) sum += step.depth;
      EXPECT_NEAR(sum, 0.5 * width_m * frame.texels_per_m, 1e-5) << width_m << ' ' << offset_m;
    }
}

TEST(DeepShadowMap, ItsStepsAreWithinTheirTolerance) {
  const LightFrame frame = frame_of(kBox);
  DeepShadowMap map(frame, 0.01);
  std::mt19937 random(4);
  std::uniform_real_distribution<float> depth(0.0f, 0.05f);
  for (int i = 0; i < 500; ++i) map.add(line(0.0f, depth(random)), 0.01, 1.0);
  map.finish();
  const auto middle = static_cast<uint32_t>(frame.in_map({}).x);
  const auto all = map.steps(middle, frame.texels / 2, 0.0);
  const auto few = map.steps(middle, frame.texels / 2, 1.0 / 64.0);
  ASSERT_EQ(all.size(), 500u);
  EXPECT_LT(few.size(), 100u);
  size_t at = 0;
  for (const ShadowStep& step : all) {
    while (at < few.size() && few[at].at_m <= step.at_m) ++at;
    const double coarse = at > 0 ? std::exp(-few[at - 1].depth) : 1.0;
    EXPECT_NEAR(coarse, std::exp(-step.depth), 1.0 / 64.0 + 1e-6);
  }
}

TEST(DeepShadowMap, LeavesOutWhatIsNoSegment) {
  DeepShadowMap map(frame_of(kBox), 0.3);
  const float nan = std::nanf("");
  std::vector<ExpandedVertex> point = line(0.0f, 0.01f);
  point[1] = point[0];
  std::vector<ExpandedVertex> lost = line(0.0f, 0.01f);
  lost[0].position_m.x = nan;
  map.add(point, 0.01, 1.0);
  map.add(lost, 0.01, 1.0);
  map.finish();
  EXPECT_THAT(map.steps(32, 32, 0.0), IsEmpty());
  EXPECT_EQ(map.optical_depth({0.0f, 0.0f, -0.04f}), 0.0);
  EXPECT_EQ(map.optical_depth({nan, 0.0f, 0.0f}), 0.0);
}

}  // namespace
}  // namespace strandcast::deep_shadow_map_test

// Curves that move as one: the movement that their roots have made, and what is no such movement.
#include "common/groom/abc_motion.h"

#include <gmock/gmock.h>

#include "tests/support/made_abc.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::abc_motion_test {
namespace {

using test::MadeAbc;
using test::MadeCurves;
using testing::HasSubstr;

constexpr int kRoots = 9, kSamples = 8;

/// Roots in one plane, which is the hardest for a rotation, about a place far from the origin.
glm::vec3 root_of(int root) {
  return {30.0f + static_cast<float>(root % 3), 2.0f, -7.0f + 1.5f * static_cast<float>(root / 3)};
}
/// Most of a turn about an axis that is none of the file's, on a way of its own.
Pose pose_of(int sample) {
  return {{0.5 * sample, -0.1 * sample * sample, 2.0},
          glm::angleAxis(0.7 * sample, glm::normalize(glm::dvec3(1, 2, -0.5)))};
}
Pose from_first(int sample) {
  const Pose first = pose_of(0), now = pose_of(sample);
  const glm::dquat rotation = now.rotation * glm::conjugate(first.rotation);
  return {now.position_m - rotation * first.position_m, rotation};
}

class AbcMotion : public testing::Test {
 protected:
  /// Strands whose tips go their own ways; `lost_root` moves by so much in the last sample.
  static MadeCurves curves(float lost_root = 0.0f, int samples = kSamples) {
    MadeCurves made;
    made.counts.assign(kRoots, 2);
    for (int sample = 0; sample < samples; ++sample) {
      std::vector<glm::vec3>& points = made.sample.emplace_back();
      for (int root = 0; root < kRoots; ++root) {
        points.emplace_back(pose_of(sample) * glm::dvec3(root_of(root)));
        if (root == 4 && sample == kSamples - 1) points.back().y += lost_root;
        points.push_back(points.back() + glm::vec3(0.3f * static_cast<float>(sample), -1.0f, 0.0f));
      }
    }
    return made;
  }
  Result<CurveMotion> motion_of(const MadeCurves& made, const std::string& metadata = {}) {
    const auto path = folder_.path() / "hair.abc";
    MadeAbc file(path);
    file.finish({file.curves(made)}, metadata);
    return load_abc_motion(path);
  }
  TemporaryFolder folder_;
};

TEST_F(AbcMotion, IsTheMovementThatTheRootsHaveMade) {
  const auto motion = motion_of(curves());
  ASSERT_TRUE(motion) << motion.error().to_string();
  ASSERT_EQ(motion->time_s.size(), static_cast<size_t>(kSamples));
  EXPECT_DOUBLE_EQ(motion->duration_s(), 0.25 * (kSamples - 1));
  for (int sample = 0; sample < kSamples; ++sample) {
    const Pose found = motion->sample(0.25 * sample), made = from_first(sample);
    for (int root = 0; root < kRoots; ++root) {
      const glm::dvec3 first = pose_of(0) * glm::dvec3(root_of(root));
      EXPECT_LT(glm::distance(found * first, made * first), 2e-5) << sample;
    }
  }
  EXPECT_EQ(motion->sample(-1.0), motion->from_first.front());
  EXPECT_EQ(motion->sample(99.0), motion->from_first.back());
  const Pose between = motion->sample(0.25 * 2.5);
  EXPECT_NEAR(angle_between_rad(motion->sample(0.5).rotation, between.rotation), 0.35, 1e-5);
}

// As a frame it would put the motion a frame too late.
TEST_F(AbcMotion, TheRestShapeOfOurOwnExportsIsNoFrame) {
  const auto whole = motion_of(curves());
  const auto motion =
      motion_of(curves(), "_ai_Description=9 strands of 2 vertices, root first, in the world. " +
                              std::string(kAbcRestSample) + ", the motion begins at sample 1.");
  ASSERT_TRUE(whole && motion) << motion.error().to_string();
  EXPECT_FALSE(whole->is_behind_rest);
  EXPECT_TRUE(motion->is_behind_rest);
  EXPECT_EQ(motion->object_count, 1u);
  EXPECT_EQ(motion->root_count, static_cast<size_t>(kRoots));
  ASSERT_EQ(motion->time_s.size(), static_cast<size_t>(kSamples - 1));
  EXPECT_EQ(motion->time_s.front(), 0.0);
  EXPECT_DOUBLE_EQ(motion->duration_s(), 0.25 * (kSamples - 2));
  for (size_t i = 0; i + 1 < kSamples; ++i) EXPECT_EQ(motion->from_first[i], whole->from_first[i + 1]) << i;
}

TEST_F(AbcMotion, WhatDoesNotMoveAsOneIsNamed) {
  EXPECT_THAT(
      motion_of(curves(0.5f)).error().to_string(),
      AllOf(HasSubstr("hair.abc"), HasSubstr("at 2.25 s"), HasSubstr("strand 4"), HasSubstr("moves as one")));
  EXPECT_TRUE(motion_of(curves(0.001f))) << "within what other programs round";
  EXPECT_THAT(motion_of(curves(0.0f, 1)).error().to_string(), HasSubstr("do not move"));
  EXPECT_THAT(load_abc_motion("none.abc").error().to_string(), HasSubstr("none.abc"));
}

}  // namespace
}  // namespace strandcast::abc_motion_test

#include <limits>
#include <numbers>

#include "common/math/pose.h"

namespace strandcast::pose_test {
namespace {

TEST(Pose, InterpolatesAlongTheShortestArc) {
  const Pose a;
  Pose b;
  b.position_m = {2.0, 0.0, 0.0};
  b.rotation = -glm::angleAxis(std::numbers::pi / 2, glm::dvec3(0.0, 1.0, 0.0));  // same rotation, other sign
  const Pose middle = interpolate(a, b, 0.5);
  EXPECT_NEAR(middle.position_m.x, 1.0, 1e-15);
  EXPECT_NEAR(angle_between_rad(a.rotation, middle.rotation), std::numbers::pi / 4, 1e-12);
}

TEST(Pose, TransformsPointsAndReportsNonFinite) {
  Pose pose;
  pose.position_m = {0.0, 1.0, 0.0};
  pose.rotation = glm::angleAxis(std::numbers::pi / 2, glm::dvec3(0.0, 0.0, 1.0));
  const glm::dvec3 point = pose * glm::dvec3(1.0, 0.0, 0.0);
  EXPECT_NEAR(point.x, 0.0, 1e-15);
  EXPECT_NEAR(point.y, 2.0, 1e-15);
  EXPECT_TRUE(is_finite(pose));
  pose.rotation.w = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(is_finite(pose));
}

}  // namespace
}  // namespace strandcast::pose_test

// How high hair is on a screen: against the law of perspective, and whether it is in the picture at all.
#include "common/render/hair_size.h"

#include <cmath>
#include <limits>

#include "tests/support/grown_hair.h"

namespace strandcast::hair_size_test {
namespace {

CameraDesc camera_from(const glm::vec3& offset_m, const glm::vec3& target_m = glm::vec3(0.0f)) {
  CameraDesc camera;
  camera.offset_m = offset_m;
  camera.target_m = target_m;
  return camera;
}

TEST(HairSize, IsAsPerspectiveHasItAndGrowsWithThePicture) {
  const HairExtent extent{{}, 0.2f, 0.3f};
  for (const float distance_m : {1.0f, 3.0f, 20.0f}) {
    const CameraDesc camera = camera_from({0.0f, 0.0f, distance_m});
    const double px = hair_height_px(extent, camera, {640, 480});
    // The picture is 2 d tan(fov / 2) high at the distance d.
    EXPECT_NEAR(px, 480.0 * 0.4 / (2.0 * distance_m * std::tan(0.5 * camera.fov_y_rad)), 1e-3 * px);
    EXPECT_NEAR(hair_height_px(extent, camera, {1280, 960}), 2.0 * px, 1e-3 * px);
  }
}

TEST(HairSize, OutsideOfThePictureIsNothingAndInsideOfTheHairIsAll) {
  const HairExtent extent{{}, 0.2f, 0.3f};
  EXPECT_EQ(hair_height_px(extent, camera_from({0.0f, 0.0f, -2.0f}, {0.0f, 0.0f, 5.0f}), {640, 480}), 0.0)
      << "behind the camera";
  EXPECT_EQ(hair_height_px(extent, camera_from({0.0f, 0.0f, 2.0f}, {3.0f, 0.0f, 0.0f}), {640, 480}), 0.0);
  EXPECT_EQ(hair_height_px(extent, camera_from({0.0f, 0.0f, 2.0f}, {0.0f, -3.0f, 0.0f}), {640, 480}), 0.0);
  EXPECT_GT(hair_height_px(extent, camera_from({0.0f, 0.0f, 2.0f}, {0.5f, 0.4f, 0.0f}), {640, 480}), 0.0)
      << "some of it may reach into the picture";
  EXPECT_EQ(hair_height_px(extent, camera_from({0.0f, 0.0f, 0.1f}), {640, 480}),
            std::numeric_limits<double>::infinity());
}

TEST(HairSize, ExtentHoldsTheGroomAndReachesAsFarAsStretchedStrands) {
  const SceneAsset asset = grown_hair();
  const HairExtent extent = hair_extent(asset);
  for (const glm::vec3& point : asset.rest_position_m) {
    EXPECT_LE(glm::distance(point, extent.center_m), extent.radius_m * 1.0001f);
    EXPECT_LE(glm::length(point), extent.reach_m);
  }
  EXPECT_GE(extent.reach_m, extent.radius_m);
  EXPECT_EQ(hair_extent({}).radius_m, 0.0f);
}

}  // namespace
}  // namespace strandcast::hair_size_test

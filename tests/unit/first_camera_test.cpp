// The camera of a scene that states none shows head and hair, and nothing else than the usual one where that
// does.
#include "server/scene/first_camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "server/scene/scene_content.h"

namespace strandcast::first_camera_test {
namespace {

/// Farthest from the middle of the picture that a point is, of half its height; upwards and downwards.
float farthest_share(const CameraDesc& camera, const std::vector<glm::vec3>& points) {
  const glm::vec3 back = glm::normalize(camera.offset_m);
  const glm::vec3 right = glm::normalize(glm::cross(glm::vec3(0.0f, 1.0f, 0.0f), back));
  const glm::vec3 up = glm::cross(back, right);
  float farthest = 0.0f;
  for (const glm::vec3& point : points) {
    const glm::vec3 from_eye = point - camera.target_m - camera.offset_m;
    const float height = -glm::dot(from_eye, back) * std::tan(0.5f * camera.fov_y_rad);
    farthest = std::max(farthest, height > 0.0f ? std::abs(glm::dot(from_eye, up)) / height : INFINITY);
  }
  return farthest;
}

const std::vector<glm::vec3> kShortHair = {{0.0f, 0.1f, 0.0f}, {0.07f, 0.02f, -0.05f}, {-0.08f, -0.1f, 0.0f}};

TEST(FirstCamera, IsTheUsualOneForHairThatItShows) {
  EXPECT_EQ(first_camera({}, kShortHair), CameraDesc());
  EXPECT_EQ(first_camera({}, {}), CameraDesc());
  const SceneDesc scene = built_in_scene();
  const auto content = load_scene_content(scene);
  ASSERT_TRUE(content.ok());
  EXPECT_EQ(first_camera(scene.camera, content->groom.rest_position_m), scene.camera);
}

TEST(FirstCamera, ACrestIsInThePicture) {
  std::vector<glm::vec3> crest = kShortHair;
  crest.emplace_back(0.0f, 0.27f, 0.02f);
  EXPECT_GT(farthest_share({}, crest), 1.0f) << "the usual one cuts it off";
  const CameraDesc camera = first_camera({}, crest);
  EXPECT_LE(farthest_share(camera, crest), 0.96f);
  EXPECT_LE(farthest_share(camera, {{0.0f, -0.13f, 0.05f}}), 0.96f) << "and so is the chin";
  EXPECT_LT(glm::length(glm::cross(camera.offset_m, CameraDesc().offset_m)), 1e-6f) << "from the same side";
  EXPECT_EQ(camera.fov_y_rad, CameraDesc().fov_y_rad);
}

TEST(FirstCamera, LongHairIsSeenFromFartherAway) {
  std::vector<glm::vec3> hair = kShortHair;
  hair.resize(20, {0.1f, -0.8f, -0.1f});
  const CameraDesc camera = first_camera({}, hair);
  EXPECT_GT(glm::length(camera.offset_m), 1.5f * glm::length(CameraDesc().offset_m));
  EXPECT_LE(farthest_share(camera, hair), 0.96f);
  hair.emplace_back(0.0f, -40.0f, 0.0f);
  EXPECT_EQ(first_camera({}, hair), camera) << "not for a single vertex";
  hair.emplace_back(0.0f, 40.0f, 0.0f);
  EXPECT_LE(glm::length(first_camera({}, hair).offset_m), kFarthestFirstM * 1.001f) << "not for ever";
}

}  // namespace
}  // namespace strandcast::first_camera_test

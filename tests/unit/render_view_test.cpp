#include "common/render/view.h"

#include <cmath>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/quaternion.hpp>

namespace strandcast::render_view_test {
namespace {

constexpr glm::uvec2 kSize(800, 400);

CameraDesc camera_at(const glm::vec3& offset_m, const glm::vec3& target_m) {
  CameraDesc camera;
  camera.offset_m = offset_m;
  camera.target_m = target_m;
  return camera;
}

// Pixel, from the bottom left, of a point given relative to the head joint along the world's axes.
glm::dvec2 pixel_of(const View& view, const glm::dquat& world_from_head_rotation, const glm::dvec3& point_m) {
  const glm::vec3 in_head(glm::inverse(world_from_head_rotation) * point_m);
  const glm::vec4 clip = view.clip_from_head * glm::vec4(in_head, 1.0f);
  return (glm::dvec2(clip) / static_cast<double>(clip.w) * 0.5 + 0.5) * glm::dvec2(view.target_px);
}

TEST(RenderView, TheTargetIsInTheMiddleOfThePicture) {
  const CameraDesc camera = camera_at({0.3f, 0.2f, 0.8f}, {0.1f, -0.05f, 0.02f});
  const auto view = make_view(camera, glm::dquat(1, 0, 0, 0), kSize);
  ASSERT_TRUE(view);
  const glm::dvec2 pixel = pixel_of(*view, glm::dquat(1, 0, 0, 0), camera.target_m);
  EXPECT_NEAR(pixel.x, kSize.x / 2.0, 1e-3);
  EXPECT_NEAR(pixel.y, kSize.y / 2.0, 1e-3);
}

TEST(RenderView, SizesOnTheScreenFollowThePinhole) {
  // 400 px high and 90 degrees: a focal length of 200 px. 0.1 m up at 2 m distance is 10 px.
  CameraDesc camera = camera_at({0, 0, 2}, {0, 0, 0});
  camera.fov_y_rad = glm::half_pi<float>();
  const auto view = make_view(camera, glm::dquat(1, 0, 0, 0), kSize);
  ASSERT_TRUE(view);
  EXPECT_NEAR(view->focal_px, 200.0, 1e-3);
  const glm::dvec2 up = pixel_of(*view, glm::dquat(1, 0, 0, 0), {0.0, 0.1, 0.0});
  EXPECT_NEAR(up.y - 200.0, 10.0, 1e-3);
  const glm::dvec2 right = pixel_of(*view, glm::dquat(1, 0, 0, 0), {0.1, 0.0, 0.0});
  EXPECT_NEAR(right.x - 400.0, 10.0, 1e-3);
}

TEST(RenderView, TurningTheHeadDoesNotTurnTheCamera) {
  const CameraDesc camera = camera_at({0.25f, 0.08f, 0.75f}, {0, 0, 0});
  const glm::dquat turn = glm::angleAxis(1.1, glm::normalize(glm::dvec3(0.2, 1.0, -0.4)));
  const auto still = make_view(camera, glm::dquat(1, 0, 0, 0), kSize);
  const auto turned = make_view(camera, turn, kSize);
  ASSERT_TRUE(still && turned);
  const glm::dvec3 in_world(0.05, 0.1, -0.07);
  const glm::dvec2 before = pixel_of(*still, glm::dquat(1, 0, 0, 0), in_world);
  const glm::dvec2 after = pixel_of(*turned, turn, in_world);
  EXPECT_NEAR(before.x, after.x, 1e-2);
  EXPECT_NEAR(before.y, after.y, 1e-2);
  const glm::dvec3 eye_in_world = turn * glm::dvec3(turned->eye_m);
  EXPECT_LT(glm::length(eye_in_world - glm::dvec3(camera.offset_m)), 1e-6);
  EXPECT_LT(glm::length(turn * glm::dvec3(turned->up) - glm::dvec3(0, 1, 0)), 1e-6);
}

TEST(RenderView, LooksStraightDown) {
  const auto view = make_view(camera_at({0, 1, 0}, {0, 0, 0}), glm::dquat(1, 0, 0, 0), kSize);
  ASSERT_TRUE(view);
  const glm::dvec2 pixel = pixel_of(*view, glm::dquat(1, 0, 0, 0), {0.1, 0.0, 0.0});
  EXPECT_TRUE(std::isfinite(pixel.x) && std::isfinite(pixel.y));
  EXPECT_GT(pixel.x, kSize.x / 2.0);
}

TEST(RenderView, ImpossibleCamerasAreRefused) {
  const glm::dquat no_turn(1, 0, 0, 0);
  EXPECT_FALSE(make_view(camera_at({0, 0, 0}, {0, 0, 0}), no_turn, kSize));
  EXPECT_FALSE(make_view(camera_at({0, NAN, 1}, {0, 0, 0}), no_turn, kSize));
  EXPECT_FALSE(make_view(camera_at({0, 0, 1}, {INFINITY, 0, 0}), no_turn, kSize));
  CameraDesc flat = camera_at({0, 0, 1}, {0, 0, 0});
  flat.fov_y_rad = 0.0f;
  EXPECT_FALSE(make_view(flat, no_turn, kSize));
  EXPECT_FALSE(make_view(camera_at({0, 0, 1}, {0, 0, 0}), no_turn, {0, 100}));
}

}  // namespace
}  // namespace strandcast::render_view_test

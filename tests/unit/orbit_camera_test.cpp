#include "client/window/orbit_camera.h"

#include <cmath>

namespace strandcast::orbit_camera_test {
namespace {

constexpr float kTolerance = 1e-5f;

/// Where a point given from the head joint appears, in window heights from the middle, right and down
/// positive.
glm::vec2 project(const CameraDesc& camera, const glm::vec3& point_m) {
  const glm::vec3 forward = -glm::normalize(camera.offset_m);
  const glm::vec3 right = glm::normalize(glm::cross(forward, glm::vec3(0, 1, 0)));
  const glm::vec3 up = glm::cross(right, forward);
  const glm::vec3 from_eye = point_m - (camera.target_m + camera.offset_m);
  const float scale = 2.0f * std::tan(0.5f * camera.fov_y_rad) * glm::dot(from_eye, forward);
  return {glm::dot(from_eye, right) / scale, -glm::dot(from_eye, up) / scale};
}

TEST(OrbitCamera, OrbitKeepsTheDistanceAndAFullTurnComesBack) {
  OrbitCamera orbit(CameraDesc{});
  const glm::vec3 start = orbit.camera().offset_m;
  for (int i = 0; i < 20; ++i) {
    orbit.orbit({0.1f, 0.0f});  // half a circle per window height: twenty tenths are a full turn
    EXPECT_NEAR(glm::length(orbit.camera().offset_m), glm::length(start), kTolerance);
    EXPECT_NEAR(orbit.camera().offset_m.y, start.y, kTolerance);
  }
  EXPECT_LT(glm::length(orbit.camera().offset_m - start), 1e-3f);
}

TEST(OrbitCamera, WhoLooksFromHomeGoesAlongWhenItMoves) {
  OrbitCamera orbit(CameraDesc{});
  CameraDesc home;
  home.fov_y_rad = 0.9f;
  EXPECT_FALSE(orbit.set_home(CameraDesc{})) << "it has not moved";
  EXPECT_TRUE(orbit.set_home(home));
  EXPECT_EQ(orbit.camera(), home);
  orbit.orbit({0.1f, 0.0f});
  const CameraDesc own = orbit.camera();
  EXPECT_FALSE(orbit.set_home(CameraDesc{})) << "who has turned away stays";
  EXPECT_EQ(orbit.camera(), own);
  orbit.reset();
  EXPECT_EQ(orbit.camera(), CameraDesc{});
}

TEST(OrbitCamera, TheSceneTurnsWithTheHand) {
  OrbitCamera orbit(CameraDesc{});
  const glm::vec3 nose = 0.1f * glm::normalize(orbit.camera().offset_m) + orbit.camera().target_m;
  orbit.orbit({0.02f, 0.0f});
  EXPECT_GT(project(orbit.camera(), nose).x, 0.0f);
  OrbitCamera other(CameraDesc{});
  other.orbit({0.0f, 0.02f});
  EXPECT_GT(project(other.camera(), nose).y, 0.0f);
}

TEST(OrbitCamera, PitchStopsShortOfThePoles) {
  OrbitCamera orbit(CameraDesc{});
  for (const float drag : {5.0f, -20.0f}) {
    orbit.orbit({0.0f, drag});
    const glm::vec3 direction = glm::normalize(orbit.camera().offset_m);
    EXPECT_NEAR(std::abs(std::asin(direction.y)), kMaxOrbitPitchRad, 1e-3f);
  }
}

TEST(OrbitCamera, PanKeepsThePointUnderTheCursor) {
  OrbitCamera orbit(CameraDesc{});
  const glm::vec3 point = orbit.camera().target_m;  // in the plane that pan moves
  const glm::vec2 drag(0.12f, -0.07f);
  orbit.pan(drag);
  const glm::vec2 moved = project(orbit.camera(), point);
  EXPECT_NEAR(moved.x, drag.x, 1e-4f);
  EXPECT_NEAR(moved.y, drag.y, 1e-4f);
}

TEST(OrbitCamera, ZoomScalesTheDistanceWithinItsLimits) {
  OrbitCamera orbit(CameraDesc{});
  const float start_m = glm::length(orbit.camera().offset_m);
  orbit.zoom(1.0f);
  EXPECT_NEAR(glm::length(orbit.camera().offset_m), start_m * kZoomPerWheelStep, kTolerance);
  orbit.zoom(-1.0f);
  EXPECT_NEAR(glm::length(orbit.camera().offset_m), start_m, kTolerance);
  orbit.zoom(1000.0f);
  EXPECT_NEAR(glm::length(orbit.camera().offset_m), kMinOrbitDistanceM, kTolerance);
  orbit.zoom(-1000.0f);
  EXPECT_NEAR(glm::length(orbit.camera().offset_m), kMaxOrbitDistanceM, 1e-3f);
}

TEST(OrbitCamera, ResetReturnsHomeAndADegenerateHomeIsReplaced) {
  CameraDesc home;
  home.target_m = {0.1f, 0.2f, 0.3f};
  OrbitCamera orbit(home);
  orbit.orbit({0.3f, 0.1f});
  orbit.pan({0.3f, 0.1f});
  orbit.zoom(3.0f);
  orbit.reset();
  EXPECT_EQ(orbit.camera().offset_m, home.offset_m);
  EXPECT_EQ(orbit.camera().target_m, home.target_m);

  home.offset_m = glm::vec3(0.0f);
  EXPECT_GT(glm::length(OrbitCamera(home).camera().offset_m), kMinOrbitDistanceM);
}

}  // namespace
}  // namespace strandcast::orbit_camera_test

#include "client/window/orbit_camera.h"

#include <algorithm>
#include <cmath>

#include "common/math/polar.h"

namespace strandcast {
namespace {

CameraDesc usable(CameraDesc home) {
  if (!(glm::length(home.offset_m) >= kMinOrbitDistanceM)) home.offset_m = CameraDesc().offset_m;
  return home;
}

}  // namespace

OrbitCamera::OrbitCamera(const CameraDesc& home) : home_(usable(home)), camera_(home_) {}

void OrbitCamera::orbit(const glm::vec2& drag_heights) {
  Polar polar = to_polar(camera_.offset_m);
  polar.yaw_rad -= drag_heights.x * kOrbitRadPerHeight;
  polar.pitch_rad = std::clamp(polar.pitch_rad + drag_heights.y * kOrbitRadPerHeight, -kMaxOrbitPitchRad,
                               kMaxOrbitPitchRad);
  camera_.offset_m = from_polar(polar);
}

void OrbitCamera::pan(const glm::vec2& drag_heights) {
  const glm::vec3 forward = -glm::normalize(camera_.offset_m);
  glm::vec3 right = glm::cross(forward, glm::vec3(0.0f, 1.0f, 0.0f));
  if (glm::length(right) < 1e-4f) right = glm::vec3(1.0f, 0.0f, 0.0f);
  right = glm::normalize(right);
  const glm::vec3 up = glm::cross(right, forward);
  const float visible_height_m = 2.0f * glm::length(camera_.offset_m) * std::tan(0.5f * camera_.fov_y_rad);
  camera_.target_m += visible_height_m * (-drag_heights.x * right + drag_heights.y * up);
  camera_.target_m = glm::clamp(camera_.target_m, glm::vec3(-kMaxOrbitPanM), glm::vec3(kMaxOrbitPanM));
}

void OrbitCamera::zoom(float wheel_steps) {
  const float distance_m = glm::length(camera_.offset_m);
  const float wanted_m = std::clamp(distance_m * std::pow(kZoomPerWheelStep, wheel_steps), kMinOrbitDistanceM,
                                    kMaxOrbitDistanceM);
  camera_.offset_m *= wanted_m / distance_m;
}

void OrbitCamera::reset() {
  camera_ = home_;
}

void OrbitCamera::look_from(const CameraDesc& camera) {
  camera_ = usable(camera);
}

bool OrbitCamera::set_home(const CameraDesc& home) {
  const CameraDesc next = usable(home);
  if (next == home_) return false;
  const bool is_at_home = camera_ == home_;
  home_ = next;
  if (is_at_home) camera_ = next;
  return is_at_home;
}

}  // namespace strandcast

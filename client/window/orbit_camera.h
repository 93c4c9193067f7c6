// OrbitCamera: turns mouse movement into a CameraDesc that circles a point of the head. Pure maths, one
// thread.
#pragma once

#include <glm/glm.hpp>

#include "common/scene/scene_desc.h"

namespace strandcast {

inline constexpr float kOrbitRadPerHeight = 3.1416f;  // dragging over the window's height turns half a circle
inline constexpr float kMaxOrbitPitchRad = 1.5f;      // just short of straight up and down
inline constexpr float kZoomPerWheelStep = 0.88f;
inline constexpr float kMinOrbitDistanceM = 0.12f;
inline constexpr float kMaxOrbitDistanceM = 30.0f;
inline constexpr float kMaxOrbitPanM = 10.0f;  // of the target from the head joint, per axis

class OrbitCamera {
 public:
  /// Starts at `home`, the view that reset() returns to.
  explicit OrbitCamera(const CameraDesc& home);

  /// Orbits by a left drag, in window heights, right and down positive: the scene turns with the hand.
  void orbit(const glm::vec2& drag_heights);
  /// Pans by a middle or right drag, in window heights: the point under the cursor stays under it.
  void pan(const glm::vec2& drag_heights);
  /// Zooms by wheel steps; positive comes closer.
  void zoom(float wheel_steps);
  void reset();
  /// Moves to this camera immediately; the view of reset() stays.
  void look_from(const CameraDesc& camera);
  /// Sets another view for reset(). If the camera is at the old one, it moves to the new one; returns true
  /// then.
  bool set_home(const CameraDesc& home);

  const CameraDesc& camera() const { return camera_; }

 private:
  CameraDesc home_;
  CameraDesc camera_;
};

}  // namespace strandcast

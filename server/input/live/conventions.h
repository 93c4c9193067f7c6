// Where the axes of live protocols point, and into Strandcast's world: right-handed, +Y up, m; a head turned
// by nothing looks along +Z, so that +X is to its left. Every conversion of axes stands here and nowhere
// else. Numbers are not looked at: what is not finite stays so. Any thread.
#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <numbers>

#include "common/base/units.h"
#include "common/math/pose.h"

namespace strandcast {

inline constexpr double kMPerCm = 0.01;
inline constexpr double kRadPerDegree = std::numbers::pi / 180.0;
inline constexpr double kRadPerHalfTurn = std::numbers::pi;

/// Three turns of a head, rad: about +Y (to its left), then about its own +X (nod down), then about its own
/// +Z (tilt to its right). Right-handed, so that each sign is that of the axis.
struct HeadTurn {
  double left_rad = 0.0;
  double down_rad = 0.0;
  double tilt_right_rad = 0.0;
};
inline glm::dquat rotation_of(const HeadTurn& turn) {
  return glm::angleAxis(turn.left_rad, glm::dvec3(0.0, 1.0, 0.0)) *
         glm::angleAxis(turn.down_rad, glm::dvec3(1.0, 0.0, 0.0)) *
         glm::angleAxis(turn.tilt_right_rad, glm::dvec3(0.0, 0.0, 1.0));
}

/// Unity, and so VMC: left-handed, +Y up, +Z ahead, +X to the right. x is mirrored; local poses of bones
/// change likewise, as the mirror image of a chain is the chain of the mirror images.
inline Pose pose_from_unity(const glm::dvec3& position_m, const glm::dquat& rotation) {
  return {{-position_m.x, position_m.y, position_m.z},
          glm::dquat(rotation.w, rotation.x, -rotation.y, -rotation.z)};
}

/// opentrack: +X to the head's left, +Y up, +Z away from where it looks, cm; yaw to the right, pitch up and
/// roll to the left, degrees. Read off its own neural tracker, which makes all six from a pose with named
/// axes.
struct OpentrackPose {
  glm::dvec3 position_cm{0.0};
  double yaw_deg = 0.0;
  double pitch_deg = 0.0;
  double roll_deg = 0.0;
};
inline Pose pose_from_opentrack(const OpentrackPose& pose) {
  const glm::dvec3& p = pose.position_cm;
  return {kMPerCm * glm::dvec3(p.x, p.y, -p.z),
          rotation_of({-kRadPerDegree * pose.yaw_deg, -kRadPerDegree * pose.pitch_deg,
                       -kRadPerDegree * pose.roll_deg})};
}

/// FreeD, by its manual's appendix B: right-handed, +Z up, a camera turned by nothing looks along +Y, so that
/// +X is to its right; pan to the right, tilt up, roll clockwise as seen from behind (to the right), degrees.
struct FreedPose {
  glm::dvec3 position_mm{0.0};
  double pan_deg = 0.0;
  double tilt_deg = 0.0;
  double roll_deg = 0.0;
};
inline Pose pose_from_freed(const FreedPose& pose) {
  const glm::dvec3& p = pose.position_mm;
  return {kMPerMm * glm::dvec3(-p.x, p.z, p.y),
          rotation_of({-kRadPerDegree * pose.pan_deg, -kRadPerDegree * pose.tilt_deg,
                       kRadPerDegree * pose.roll_deg})};
}

/// Which way is up where a system lets its user choose (Motive, VRPN's servers). Right-handed, m.
enum class SystemUp { Y, Z };
/// +Z up: a quarter turn about X lays +Z onto +Y. Bodies turned by nothing stay so.
inline Pose pose_from_system(SystemUp up, const glm::dvec3& position_m, const glm::dquat& rotation) {
  if (up == SystemUp::Y) return {position_m, rotation};
  return {{position_m.x, position_m.z, -position_m.y},
          glm::dquat(rotation.w, rotation.x, rotation.z, -rotation.y)};
}

/// A face as ARKit sees it: its axes are those of a head here, and the angles turn about them.
inline Pose pose_from_face(double yaw_rad, double pitch_rad, double roll_rad) {
  return {glm::dvec3(0.0), rotation_of({yaw_rad, pitch_rad, roll_rad})};
}

}  // namespace strandcast

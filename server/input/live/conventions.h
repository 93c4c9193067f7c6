// Converts the axes of live protocols to Strandcast's world: right-handed, +Y up, metres. A head without
// rotation looks along +Z, so +X is to its left. All conversions of axes are here. Values are not checked,
// non-finite ones pass through; only an angle that no head has gives no rotation (NaN). Any thread.
#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <numbers>

#include "common/base/units.h"
#include "common/math/pose.h"

namespace strandcast {

inline constexpr double kMPerCm = 0.01;
inline constexpr double kRadPerDegree = std::numbers::pi / 180.0;
inline constexpr double kRadPerHalfTurn = std::numbers::pi;

/// Rotation of a head by three angles, rad: about +Y (to its left), then its own +X (nod down), then its own
/// +Z (tilt to its right). Right-handed, so each sign follows its axis.
struct HeadTurn {
  double left_rad = 0.0;
  double down_rad = 0.0;
  double tilt_right_rad = 0.0;
};
/// Angles beyond two turns are no angles of a head: they were read wrongly, or are of something else.
inline constexpr double kMostAngleRad = 720.001 * kRadPerDegree;
inline glm::dquat rotation_of(const HeadTurn& turn) {
  const auto is_possible = [](double angle_rad) { return glm::abs(angle_rad) <= kMostAngleRad; };
  if (!is_possible(turn.left_rad) || !is_possible(turn.down_rad) || !is_possible(turn.tilt_right_rad)) {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    return {kNone, kNone, kNone, kNone};
  }
  return glm::angleAxis(turn.left_rad, glm::dvec3(0.0, 1.0, 0.0)) *
         glm::angleAxis(turn.down_rad, glm::dvec3(1.0, 0.0, 0.0)) *
         glm::angleAxis(turn.tilt_right_rad, glm::dvec3(0.0, 0.0, 1.0));
}

/// Unity and VMC: left-handed, +Y up, +Z ahead, +X to the right. x is mirrored. Local poses of bones change
/// the same way, because the mirror image of a chain is the chain of the mirror images.
inline Pose pose_from_unity(const glm::dvec3& position_m, const glm::dquat& rotation) {
  return {{-position_m.x, position_m.y, position_m.z},
          glm::dquat(rotation.w, rotation.x, -rotation.y, -rotation.z)};
}

/// opentrack: +X to the head's left, +Y up, +Z opposite to its gaze, cm; yaw to the right, pitch up and roll
/// to the left, degrees. Derived from opentrack's own neural tracker, which computes all six from a pose with
/// named axes.
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

/// FreeD, by appendix B of its manual: right-handed, +Z up. A camera without rotation looks along +Y, so +X
/// is to its right. Pan to the right, tilt up, roll clockwise as seen from behind, degrees.
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

/// OpenTrackIO: right-handed, +Z up, +Y ahead, so +X is to the right, m. Pan about +Z, tilt about +X and roll
/// about +Y, each right-handed and after the one before, degrees: pan to the left, tilt up, roll clockwise as
/// seen from behind.
struct TrackPose {
  glm::dvec3 translation_m{0.0};
  double pan_deg = 0.0;
  double tilt_deg = 0.0;
  double roll_deg = 0.0;
};
inline Pose pose_from_track(const TrackPose& pose) {
  const glm::dvec3& p = pose.translation_m;
  return {glm::dvec3(-p.x, p.z, p.y),
          rotation_of(
              {kRadPerDegree * pose.pan_deg, -kRadPerDegree * pose.tilt_deg, kRadPerDegree * pose.roll_deg})};
}

/// Up axis of systems that let the user choose it (Motive, VRPN's servers). Right-handed, m.
enum class SystemUp { Y, Z };
/// Converts a pose; for +Z up, a quarter turn about X maps +Z to +Y. Bodies without rotation stay so.
inline Pose pose_from_system(SystemUp up, const glm::dvec3& position_m, const glm::dquat& rotation) {
  if (up == SystemUp::Y) return {position_m, rotation};
  return {{position_m.x, position_m.z, -position_m.y},
          glm::dquat(rotation.w, rotation.x, rotation.z, -rotation.y)};
}

/// Xsens MVN: right-handed, +Z up. A segment without rotation looks along +X, so +Y is to its left.
inline Pose pose_from_mvn(const glm::dvec3& position_m, const glm::dquat& rotation) {
  return {{position_m.y, position_m.z, position_m.x},
          glm::dquat(rotation.w, rotation.y, rotation.z, rotation.x)};
}

/// Pose of a face as ARKit reports it: its axes are those of a head here, and the angles turn about them.
inline Pose pose_from_face(double yaw_rad, double pitch_rad, double roll_rad) {
  return {glm::dvec3(0.0), rotation_of({yaw_rad, pitch_rad, roll_rad})};
}

}  // namespace strandcast

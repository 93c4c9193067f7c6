// Rigid poses. Head space: origin at the head joint, +Y up, +Z out of the face, metres, right-handed.
// World space: +Y up, metres, right-handed. Positions in the world are double: 100 m from the origin a float
// already loses a hundredth of a millimetre.
#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

namespace strandcast {

/// A pose: translation and unit quaternion, used as world_from_head; world_from_head * point_in_head
/// transforms a point.
struct Pose {
  glm::dvec3 position_m{0.0};
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};  // (w, x, y, z), unit length

  glm::dvec3 operator*(const glm::dvec3& point) const { return position_m + rotation * point; }
  bool operator==(const Pose&) const = default;
};

/// Returns true if every component is finite.
bool is_finite(const Pose& pose);

/// Interpolates position on a straight line and rotation on the shortest arc; `blend` 0 gives a, 1 gives b.
Pose interpolate(const Pose& a, const Pose& b, double blend);

/// Returns the angle of the rotation from a to b in radians, 0..pi.
double angle_between_rad(const glm::dquat& a, const glm::dquat& b);

}  // namespace strandcast

// Rigid poses. Head space: origin at the head joint, +Y up, +Z out of the face, metres, right-handed.
// World space: +Y up, metres, right-handed. Positions in the world are double: 100 m from the origin a float
// already loses a hundredth of a millimetre.
#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

namespace strandcast {

/// world_from_head as translation and unit quaternion; world_from_head * point_in_head reads right.
struct Pose {
  glm::dvec3 position_m{0.0};
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};  // (w, x, y, z), unit length

  glm::dvec3 operator*(const glm::dvec3& point) const { return position_m + rotation * point; }
  bool operator==(const Pose&) const = default;
};

/// True when every component is finite.
bool is_finite(const Pose& pose);

/// Straight line for the position, shortest arc for the rotation; blend 0 gives a, 1 gives b.
Pose interpolate(const Pose& a, const Pose& b, double blend);

/// Angle in radians of the rotation from a to b, 0..pi.
double angle_between_rad(const glm::dquat& a, const glm::dquat& b);

}  // namespace strandcast

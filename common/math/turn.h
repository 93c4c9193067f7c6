// Rotations as vectors: axis times angle in radians, world axes. Pure functions, any thread.
#pragma once

#include <cmath>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

namespace strandcast {

/// Returns the shortest rotation from a to b (unit quaternions) as axis times angle, rad; zero if they are
/// equal.
inline glm::dvec3 turn_between(const glm::dquat& a, const glm::dquat& b) {
  glm::dquat turn = b * glm::conjugate(a);
  if (turn.w < 0.0) turn = -turn;
  const glm::dvec3 sine(turn.x, turn.y, turn.z);
  const double length = glm::length(sine);
  if (length == 0.0) return glm::dvec3(0.0);
  return sine * (2.0 * std::atan2(length, turn.w) / length);
}

/// Returns `from` rotated by axis times angle, rad; `from` itself if that is zero.
inline glm::dquat turned(const glm::dquat& from, const glm::dvec3& turn_rad) {
  const double angle_rad = glm::length(turn_rad);
  if (angle_rad == 0.0) return from;
  return glm::normalize(glm::angleAxis(angle_rad, turn_rad / angle_rad) * from);
}

/// Returns a smooth rise from 0 at x = 0 to 1 at x = 1, with no slope and no curvature at either end;
/// constant outside.
inline double ease(double x) {
  if (x <= 0.0) return 0.0;
  if (x >= 1.0) return 1.0;
  return x * x * x * (10.0 + x * (6.0 * x - 15.0));
}

}  // namespace strandcast

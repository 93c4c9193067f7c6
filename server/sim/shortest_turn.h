// The shortest rotation between two directions, applied to vectors. Pure functions.
#pragma once

#include <cmath>
#include <glm/glm.hpp>

namespace strandcast {

/// Rotates `v` by the shortest rotation from `from` to `to`, which must be unit vectors or zero. Keeps its
/// length.
inline glm::vec3 shortest_turn(const glm::vec3& v, const glm::vec3& from, const glm::vec3& to) {
  constexpr float kOpposite = 1e-4f;
  const float cosine = glm::dot(from, to);
  if (1.0f + cosine < kOpposite) return v - 2.0f * glm::dot(from, v) * from;
  const glm::vec3 axis = glm::cross(from, to);
  const glm::vec3 turned = cosine * v + glm::cross(axis, v) + axis * (glm::dot(axis, v) / (1.0f + cosine));
  // Near to opposite the last term is a quotient of small numbers: its rounding would change the length.
  const float squared = glm::dot(turned, turned);
  return squared > 0.0f ? turned * std::sqrt(glm::dot(v, v) / squared) : turned;
}

}  // namespace strandcast

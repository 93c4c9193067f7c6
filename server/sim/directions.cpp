#include "server/sim/directions.h"

#include <cmath>

namespace strandcast {

glm::dvec3 direction_or(const glm::dvec3& vector, const glm::dvec3& otherwise) {
  constexpr double kTinyLength = 1e-10;
  const double length = glm::length(vector);
  return length > kTinyLength ? vector / length : otherwise;
}

glm::dquat smallest_rotation(const glm::dvec3& from, const glm::dvec3& to) {
  constexpr double kOpposite = 1e-12;  // of one and the cosine
  const double cosine = glm::dot(from, to);
  if (cosine < -1.0 + kOpposite) {
    const glm::dvec3 other = std::abs(from.x) < 0.6 ? glm::dvec3(1.0, 0.0, 0.0) : glm::dvec3(0.0, 1.0, 0.0);
    return glm::angleAxis(glm::radians(180.0), glm::normalize(glm::cross(from, other)));
  }
  return glm::normalize(glm::dquat(1.0 + cosine, glm::cross(from, to)));
}

glm::dvec3 any_perpendicular(const glm::dvec3& direction) {
  const glm::dvec3 other =
      std::abs(direction.x) < 0.6 ? glm::dvec3(1.0, 0.0, 0.0) : glm::dvec3(0.0, 1.0, 0.0);
  return glm::normalize(glm::cross(direction, other));
}

glm::dmat3 cross_matrix(const glm::dvec3& v) {
  return {glm::dvec3(0.0, v.z, -v.y), glm::dvec3(-v.z, 0.0, v.x), glm::dvec3(v.y, -v.x, 0.0)};
}

}  // namespace strandcast

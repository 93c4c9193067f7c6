// Directions in double precision for the reference solvers. Pure functions, any thread.
#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

namespace strandcast {

/// Returns the unit direction of a vector, or `otherwise` if it is too short to have one.
glm::dvec3 direction_or(const glm::dvec3& vector, const glm::dvec3& otherwise);

/// Returns the smallest rotation from one unit vector to another; an arbitrary one of them for opposite
/// vectors.
glm::dquat smallest_rotation(const glm::dvec3& from, const glm::dvec3& to);

/// Returns a unit vector perpendicular to `direction`.
glm::dvec3 any_perpendicular(const glm::dvec3& direction);

/// Returns the matrix that maps x to the cross product v x x.
glm::dmat3 cross_matrix(const glm::dvec3& v);

}  // namespace strandcast

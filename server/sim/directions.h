// Directions in double precision, as the reference solvers need them. Pure functions, any thread.
#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

namespace strandcast {

/// The vector's direction, or the other one where it is too short to have any.
glm::dvec3 direction_or(const glm::dvec3& vector, const glm::dvec3& otherwise);

/// Smallest rotation from one unit vector to another; of opposite ones, any.
glm::dquat smallest_rotation(const glm::dvec3& from, const glm::dvec3& to);

/// A unit vector at right angles to one.
glm::dvec3 any_perpendicular(const glm::dvec3& direction);

/// The matrix that takes x to v x x.
glm::dmat3 cross_matrix(const glm::dvec3& v);

}  // namespace strandcast

// Finds the movement that takes points nearest to others. Pure function, any thread.
#pragma once

#include <glm/glm.hpp>
#include <span>

#include "common/math/pose.h"

namespace strandcast {

/// Returns the rotation and shift that take `from` nearest to `to`, point by point; as many of both, at least
/// one. The rotation is searched from `guess` on.
Pose rigid_fit(std::span<const glm::dvec3> from, std::span<const glm::dvec3> to, glm::dquat guess);

}  // namespace strandcast

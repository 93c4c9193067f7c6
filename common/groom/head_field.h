// HeadField: the built-in head as an implicit surface: rounded shapes, blended smoothly. Lengths are in skull
// radii about the skull's centre; +Y up, +Z out of the face. Any thread.
#pragma once

#include <glm/glm.hpp>

namespace strandcast {

/// About the distance to the head's surface, negative inside. Closed: the neck ends in a flat cut.
float head_distance(const glm::vec3& point);

/// Unit normal of the surface through `point`, outwards.
glm::vec3 head_normal(const glm::vec3& point);

// Box that holds the whole surface.
inline constexpr glm::vec3 kHeadLow{-1.25f, -2.45f, -1.15f};
inline constexpr glm::vec3 kHeadHigh{1.25f, 1.1f, 1.4f};

}  // namespace strandcast

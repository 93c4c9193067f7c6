// The first camera of a scene that states none: the usual one, moved up or down and back as far as all of
// head and hair needs to be in the picture. Pure function, any thread.
#pragma once

#include <glm/glm.hpp>
#include <span>

#include "common/scene/scene_desc.h"

namespace strandcast {

/// `home` where it shows the skull and the hair at rest: all of it that rises, and 19 of 20 vertices of what
/// hangs. Else the same direction and angle from farther away, at most kFarthestFirstM. `rest_in_head_m`: all
/// vertices of the hair, under a head that is upright.
CameraDesc first_camera(const CameraDesc& home, std::span<const glm::vec3> rest_in_head_m);

inline constexpr float kFarthestFirstM = 3.0f;

}  // namespace strandcast

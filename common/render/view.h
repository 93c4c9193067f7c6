// Camera mathematics: projects points of head space to the screen. Everything is relative to the head joint,
// so float precision does not depend on the head's position in the world. Pure functions, any thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

#include "common/base/result.h"
#include "common/math/pose.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

struct View {
  glm::mat4 clip_from_head{1.0f};
  glm::vec3 eye_m{0.0f};           // head space
  glm::vec3 up{0.0f, 1.0f, 0.0f};  // world's up, head space
  glm::vec2 target_px{1.0f};       // drawn size
  float focal_px = 1.0f;           // pixels per metre at 1 m distance
  float near_m = 0.01f;
  float far_m = 50.0f;
  float target_distance_m = 1.0f;  // from the eye to the point looked at
};

/// Makes a view. The camera follows the head's position, not its rotation. BadInput for a camera that is not
/// finite, sits on its target or has a field of view outside (0, pi).
Result<View> make_view(const CameraDesc& camera, const glm::dquat& world_from_head_rotation,
                       glm::uvec2 target_px);

}  // namespace strandcast

// Lights and colours of a look as the laws of shading take them. Pure functions, any thread.
#pragma once

#include <glm/glm.hpp>

#include "common/math/pose.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

/// Unit vectors in head space.
struct LightDirections {
  glm::vec3 to_key{0.0f, 1.0f, 0.0f};
  glm::vec3 to_rim{0.0f, 1.0f, 0.0f};
  glm::vec3 up{0.0f, 1.0f, 0.0f};
  bool has_rim = false;
};

/// Towards a light that travels along `direction` of the world, in head space, unit; of one without a
/// direction, straight up in the world.
glm::vec3 to_light_in_head(const glm::vec3& direction, const glm::dquat& world_from_head_rotation);

/// `up`: world's up, head space.
LightDirections light_directions(const LookDesc& look, const glm::dquat& world_from_head_rotation,
                                 const glm::vec3& up);

/// The look in the numbers of shaders/lib/hair_light.glsl.
struct ShadingNumbers {
  glm::vec3 root_color, tip_color;
  float diffuse, scatter, highlight, transmission, second_highlight;
  float width_rad, tilt_rad, tilt_spread_rad;
  float root_darkening, strand_variation, lock_variation, warmth_variation, wetness;
  glm::vec3 key_color, rim_color;
  glm::vec3 skin_color;
  float ambient;
};
ShadingNumbers shading_numbers(const LookDesc& look);

}  // namespace strandcast

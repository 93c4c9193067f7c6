// Converts the lights and colours of a look into the inputs of the shading formulas. Pure functions, any
// thread.
#pragma once

#include <glm/glm.hpp>

#include "common/math/pose.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

/// Directions towards the lights: unit vectors in head space.
struct LightDirections {
  glm::vec3 to_key{0.0f, 1.0f, 0.0f};
  glm::vec3 to_rim{0.0f, 1.0f, 0.0f};
  glm::vec3 up{0.0f, 1.0f, 0.0f};
  bool has_rim = false;
};

/// Returns the unit direction in head space towards a light that travels along `direction` in the world. A
/// zero direction gives the world's up.
glm::vec3 to_light_in_head(const glm::vec3& direction, const glm::dquat& world_from_head_rotation);

/// Returns the directions to the lights; `up` is the world's up in head space.
LightDirections light_directions(const LookDesc& look, const glm::dquat& world_from_head_rotation,
                                 const glm::vec3& up);

/// The look as the parameters of shaders/lib/hair_light.glsl.
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

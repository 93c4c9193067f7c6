// Converts the lights and colours of a look into the inputs of the shading formulas. Pure functions, any
// thread.
#pragma once

#include <array>
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

/// Ways along which light of the sky is looked for.
inline constexpr int kSkyWays = 6;
/// Returns unit vectors to parts of the sky that count alike: straight up, and five around, 50 degrees from
/// it. They change smoothly with `up`, except where it points straight down.
std::array<glm::vec3, kSkyWays> sky_ways(const glm::vec3& up);

/// The look as the parameters of shaders/lib/hair_light.glsl.
struct ShadingNumbers {
  glm::vec3 root_color{0.0f}, tip_color{0.0f};
  // schema begin: shading numbers
  // clang-format off
  float diffuse = 0.0f;
  float scatter = 0.0f;
  float highlight = 0.0f;
  float transmission = 0.0f;
  float second_highlight = 0.0f;
  float width_rad = 0.0f;
  float tilt_rad = 0.0f;
  float tilt_spread_rad = 0.0f;
  float root_darkening = 0.0f;
  float strand_variation = 0.0f;
  float lock_variation = 0.0f;
  float warmth_variation = 0.0f;
  float wetness = 0.0f;
  // clang-format on
  // schema end
  glm::vec3 key_color{0.0f}, rim_color{0.0f};
  glm::vec3 skin_color{0.0f};
  float ambient = 0.0f;
};
ShadingNumbers shading_numbers(const LookDesc& look);

}  // namespace strandcast

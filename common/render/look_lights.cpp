#include "common/render/look_lights.h"

#include <glm/gtc/quaternion.hpp>

#include "common/scene/hair_color.h"

namespace strandcast {

glm::vec3 to_light_in_head(const glm::vec3& direction, const glm::dquat& world_from_head_rotation) {
  const glm::mat3 head_from_world(glm::transpose(glm::mat3_cast(world_from_head_rotation)));
  const float length = glm::length(direction);
  return glm::normalize(head_from_world *
                        (length > 0.0f ? -direction / length : glm::vec3(0.0f, 1.0f, 0.0f)));
}

LightDirections light_directions(const LookDesc& look, const glm::dquat& world_from_head_rotation,
                                 const glm::vec3& up) {
  return {to_light_in_head(look.light_direction, world_from_head_rotation),
          to_light_in_head(look.rim_direction, world_from_head_rotation), up,
          look.rim_color != glm::vec3(0.0f)};
}

ShadingNumbers shading_numbers(const LookDesc& look) {
  const HairColors colors = colors_of(look);
  const HairShadingDesc& s = look.shading;
  return {colors.root,
          colors.tip,
          s.diffuse,
          s.scatter,
          s.highlight,
          s.transmission,
          s.second_highlight,
          glm::radians(s.highlight_width_deg),
          glm::radians(s.cuticle_deg),
          glm::radians(s.cuticle_spread_deg),
          s.root_darkening,
          s.strand_variation,
          s.lock_variation,
          s.warmth_variation,
          s.wetness,
          look.exposure * look.light_color,
          look.exposure * look.rim_color,
          look.skin_color,
          look.exposure * look.ambient};
}

}  // namespace strandcast

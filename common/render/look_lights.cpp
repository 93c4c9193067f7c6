#include "common/render/look_lights.h"

#include <algorithm>
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

std::array<glm::vec3, kSkyWays> sky_ways(const glm::vec3& up) {
  constexpr float kUpwards = 0.64278761f;  // cosine and sine of 50 degrees
  constexpr float kAside = 0.76604444f;
  // Of a fifth of a turn, and of two.
  constexpr float kCos[] = {1.0f, 0.30901699f, -0.80901699f, -0.80901699f, 0.30901699f};
  constexpr float kSin[] = {0.0f, 0.95105652f, 0.58778525f, -0.58778525f, -0.95105652f};
  // Duff et al. 2017, Building an orthonormal basis, revisited; about y.
  constexpr float kLeast = 1e-3f;
  const float scale = 1.0f / std::max(1.0f + up.y, kLeast);
  const glm::vec3 side(1.0f - up.x * up.x * scale, -up.x, -up.x * up.z * scale);
  const glm::vec3 other = glm::cross(up, side);
  std::array<glm::vec3, kSkyWays> ways{up};
  for (int i = 1; i < kSkyWays; ++i)
    ways[i] = glm::normalize(kUpwards * up + kAside * (kCos[i - 1] * side + kSin[i - 1] * other));
  return ways;
}

ShadingNumbers shading_numbers(const LookDesc& look) {
  const HairColors colors = colors_of(look);
  const HairShadingDesc& s = look.shading;
  ShadingNumbers n;
  n.root_color = colors.root;
  n.tip_color = colors.tip;
  // schema begin: set shading
  // clang-format off
  n.diffuse = s.diffuse;
  n.scatter = s.scatter;
  n.highlight = s.highlight;
  n.transmission = s.transmission;
  n.second_highlight = s.second_highlight;
  n.width_rad = glm::radians(s.highlight_width_deg);
  n.tilt_rad = glm::radians(s.cuticle_deg);
  n.tilt_spread_rad = glm::radians(s.cuticle_spread_deg);
  n.root_darkening = s.root_darkening;
  n.strand_variation = s.strand_variation;
  n.lock_variation = s.lock_variation;
  n.warmth_variation = s.warmth_variation;
  n.wetness = s.wetness;
  // clang-format on
  // schema end
  n.key_color = look.exposure * look.light_color;
  n.rim_color = look.exposure * look.rim_color;
  n.skin_color = look.skin_color;
  n.ambient = look.exposure * look.ambient;
  return n;
}

}  // namespace strandcast

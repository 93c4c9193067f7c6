// Where hair lies as the light sees it: a square map across the light, and the depth along it. Pure
// functions, any thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>

namespace strandcast {

struct LightFrame {
  /// x and y: texels of the map; z: metres along the light's way from where the hair begins.
  glm::mat4 map_from_head{1.0f};
  uint32_t texels = 1;  // along each side of the map
  float texels_per_m = 1.0f;
  float depth_m = 1.0f;  // of the hair along the light

  glm::vec3 in_map(const glm::vec3& point_m) const;
};

/// Around the points and `margin_m` more on all sides. Steps of size and place are whole, so that nothing
/// shimmers when the hair moves a little. Points that are not numbers, or absurdly far, do not count.
LightFrame fit_light_frame(std::span<const glm::vec3> position_m, const glm::vec3& to_light, uint32_t texels,
                           float margin_m);

/// The same, as a cube of cells with the axes of head space.
struct HairCube {
  glm::vec3 origin_m{0.0f};
  float side_m = 1.0f;
};
HairCube fit_hair_cube(std::span<const glm::vec3> position_m, float margin_m);

}  // namespace strandcast

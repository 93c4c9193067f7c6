// LightFrame: bounds of the hair as the light sees it: a square map across the light, and depth along it.
// Pure functions, any thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>

namespace strandcast {

struct LightFrame {
  /// Transform to the map: x and y in texels, z in metres along the light from where the hair begins.
  glm::mat4 map_from_head{1.0f};
  uint32_t texels = 1;  // along each side of the map
  float texels_per_m = 1.0f;
  float depth_m = 1.0f;  // of the hair along the light

  glm::vec3 in_map(const glm::vec3& point_m) const;
};

/// Fits a frame around the points with `margin_m` on all sides. Size and position change in whole steps, so
/// that small motion of the hair causes no shimmer. Non-finite or absurdly distant points are ignored.
LightFrame fit_light_frame(std::span<const glm::vec3> position_m, const glm::vec3& to_light, uint32_t texels,
                           float margin_m);

/// Bounds of the hair as a cube of cells along the axes of head space.
struct HairCube {
  glm::vec3 origin_m{0.0f};
  float side_m = 1.0f;
};
HairCube fit_hair_cube(std::span<const glm::vec3> position_m, float margin_m);

}  // namespace strandcast

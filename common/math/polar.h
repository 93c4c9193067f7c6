// Polar: position about a centre as distance, azimuth and elevation. Pure functions, any thread.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>

namespace strandcast {

struct Polar {
  float distance_m = 1.0f;
  float yaw_rad = 0.0f;    // about +Y, from +Z towards +X
  float pitch_rad = 0.0f;  // above the horizon
};

/// Converts an offset from the centre, which must not be zero.
inline Polar to_polar(const glm::vec3& offset_m) {
  const float distance_m = glm::length(offset_m);
  return {distance_m, std::atan2(offset_m.x, offset_m.z),
          std::asin(std::clamp(offset_m.y / distance_m, -1.0f, 1.0f))};
}

inline glm::vec3 from_polar(const Polar& polar) {
  const float level = std::cos(polar.pitch_rad);
  return polar.distance_m * glm::vec3(level * std::sin(polar.yaw_rad), std::sin(polar.pitch_rad),
                                      level * std::cos(polar.yaw_rad));
}

}  // namespace strandcast

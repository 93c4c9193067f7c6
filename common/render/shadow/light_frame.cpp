#include "common/render/shadow/light_frame.h"

#include <algorithm>
#include <cmath>

namespace strandcast {
namespace {

constexpr float kFarLightM = 100.0f;
// Sides grow and shrink in steps of this.
constexpr float kSideStepM = 0.02f;

struct Box {
  glm::vec3 low{0.0f};
  glm::vec3 high{0.0f};
};

/// Of the points seen along three axes; nothing around the origin when no point counts.
Box bounds(std::span<const glm::vec3> position_m, const glm::mat3& axes, float margin_m) {
  const glm::mat3 from_head = glm::transpose(axes);
  Box box;
  bool is_empty = true;
  for (const glm::vec3& point : position_m) {
    const glm::vec3 size = glm::abs(point);
    if (!(size.x < kFarLightM && size.y < kFarLightM && size.z < kFarLightM)) continue;
    const glm::vec3 seen = from_head * point;
    box.low = is_empty ? seen : glm::min(box.low, seen);
    box.high = is_empty ? seen : glm::max(box.high, seen);
    is_empty = false;
  }
  return {box.low - margin_m, box.high + margin_m};
}

float in_steps(float length_m) {
  return kSideStepM * std::max(1.0f, std::ceil(length_m / kSideStepM));
}

}  // namespace

glm::vec3 LightFrame::in_map(const glm::vec3& point_m) const {
  return glm::vec3(map_from_head * glm::vec4(point_m, 1.0f));
}

LightFrame fit_light_frame(std::span<const glm::vec3> position_m, const glm::vec3& to_light, uint32_t texels,
                           float margin_m) {
  const glm::vec3 away = -to_light;
  const glm::vec3 helper = std::abs(away.y) < 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0);
  const glm::vec3 right = glm::normalize(glm::cross(helper, away));
  const glm::mat3 axes(right, glm::cross(away, right), away);
  const Box box = bounds(position_m, axes, margin_m);
  const glm::vec3 extent = box.high - box.low;
  LightFrame frame;
  frame.texels = texels;
  // A texel more on each side is for the snap below.
  const float side_m = in_steps(std::max(extent.x, extent.y)) * (1.0f + 2.0f / static_cast<float>(texels));
  frame.texels_per_m = static_cast<float>(texels) / side_m;
  frame.depth_m = extent.z;
  const glm::vec2 corner_m = 0.5f * (glm::vec2(box.low) + glm::vec2(box.high)) - 0.5f * side_m;
  const glm::vec2 corner = glm::floor(corner_m * frame.texels_per_m);
  const glm::mat3 from_head = glm::transpose(axes);
  for (int column = 0; column < 3; ++column)
    frame.map_from_head[column] =
        glm::vec4(glm::vec2(from_head[column]) * frame.texels_per_m, from_head[column].z, 0.0f);
  frame.map_from_head[3] = glm::vec4(-corner, -box.low.z, 1.0f);
  return frame;
}

HairCube fit_hair_cube(std::span<const glm::vec3> position_m, float margin_m) {
  const Box box = bounds(position_m, glm::mat3(1.0f), margin_m);
  const glm::vec3 extent = box.high - box.low;
  const float side_m = in_steps(std::max({extent.x, extent.y, extent.z}));
  return {0.5f * (box.low + box.high) - 0.5f * side_m, side_m};
}

}  // namespace strandcast

#include "common/render/hair_size.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/render/view.h"

namespace strandcast {

HairExtent hair_extent(const SceneAsset& asset) {
  HairExtent extent;
  if (asset.rest_position_m.empty()) return extent;
  glm::vec3 low = asset.rest_position_m.front(), high = low;
  for (const glm::vec3& point : asset.rest_position_m) {
    low = glm::min(low, point);
    high = glm::max(high, point);
  }
  extent.center_m = 0.5f * (low + high);
  for (const glm::vec3& point : asset.rest_position_m)
    extent.radius_m = std::max(extent.radius_m, glm::distance(extent.center_m, point));
  for (uint32_t strand = 0; strand < asset.strand_count; ++strand) {
    float reach_m = glm::length(asset.rest_position_m[strand]);
    for (size_t v = 1; v < asset.vertex_count; ++v) {
      const size_t i = v * asset.strand_count + strand;
      reach_m += glm::distance(asset.rest_position_m[i], asset.rest_position_m[i - asset.strand_count]);
    }
    extent.reach_m = std::max(extent.reach_m, reach_m);
  }
  return extent;
}

// The camera follows the head's place and not its turn: what can be seen is looked for in all that hair
// reaches in any turn, its size is that of the upright groom.
double hair_height_px(const HairExtent& extent, const CameraDesc& camera, glm::uvec2 picture_px) {
  constexpr double kWhole = std::numeric_limits<double>::infinity();
  const auto view = make_view(camera, glm::dquat(1.0, 0.0, 0.0, 0.0), picture_px);
  if (!view) return kWhole;
  const glm::dvec3 eye(view->eye_m);
  const glm::dvec3 forward = -glm::normalize(glm::dvec3(camera.offset_m));
  const glm::dvec3 right = glm::normalize(
      glm::cross(forward, std::abs(forward.y) < 0.999 ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, -1)));
  const glm::dvec3 up = glm::cross(right, forward);
  // The head joint against the four sides of the picture and the plane of the eye.
  const glm::dvec3 joint = -eye;
  const double reach_m = extent.reach_m;
  if (glm::dot(joint, forward) < -reach_m) return 0.0;
  const double tan_y = std::tan(0.5 * camera.fov_y_rad);
  const double tan_x = tan_y * picture_px.x / picture_px.y;
  const auto is_outside = [&](const glm::dvec3& across, double tangent) {
    const double distance_m = std::abs(glm::dot(joint, across)) - tangent * glm::dot(joint, forward);
    return distance_m > reach_m * std::sqrt(1.0 + tangent * tangent);
  };
  if (is_outside(right, tan_x) || is_outside(up, tan_y)) return 0.0;
  const double distance_m = glm::distance(eye, glm::dvec3(extent.center_m));
  if (distance_m <= extent.radius_m) return kWhole;
  return 2.0 * extent.radius_m * view->focal_px / distance_m;
}

}  // namespace strandcast

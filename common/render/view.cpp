#include "common/render/view.h"

#include <cmath>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/matrix_transform.hpp>

namespace strandcast {
namespace {

constexpr double kNearShare = 0.02;  // near plane, of the distance to the target
constexpr double kFarPlaneM = 50.0;  // behind the target
constexpr double kParallel = 0.999;  // |cosine| from which the view counts as straight up or down

bool is_finite(const glm::vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

}  // namespace

Result<View> make_view(const CameraDesc& camera, const glm::dquat& world_from_head_rotation,
                       glm::uvec2 target_px) {
  const double distance_m = glm::length(glm::dvec3(camera.offset_m));
  if (!is_finite(camera.offset_m) || !is_finite(camera.target_m) || !(distance_m > 0.0))
    return make_error(ErrorCode::BadInput,
                      "the camera must be finite and away from its target, not {} m from it", distance_m);
  if (!(camera.fov_y_rad > 0.0f && camera.fov_y_rad < glm::pi<float>()))
    return make_error(ErrorCode::BadInput, "camera.fov_y_rad is {} but must lie between 0 and pi",
                      camera.fov_y_rad);
  if (target_px.x == 0 || target_px.y == 0)
    return make_error(ErrorCode::BadInput, "a picture of {} x {} pixels has no area", target_px.x,
                      target_px.y);

  const glm::dvec3 target(camera.target_m);
  const glm::dvec3 eye = target + glm::dvec3(camera.offset_m);
  const glm::dvec3 forward = (target - eye) / distance_m;
  const glm::dvec3 world_up(0.0, 1.0, 0.0);
  const glm::dvec3 screen_up = std::abs(forward.y) < kParallel ? world_up : glm::dvec3(0.0, 0.0, -1.0);
  const double near_m = kNearShare * distance_m;
  const double aspect = static_cast<double>(target_px.x) / target_px.y;
  const glm::dmat4 clip_from_eye =
      glm::perspective(static_cast<double>(camera.fov_y_rad), aspect, near_m, distance_m + kFarPlaneM);
  const glm::dmat4 eye_from_world = glm::lookAt(eye, target, screen_up);
  const glm::dmat3 head_from_world = glm::transpose(glm::mat3_cast(world_from_head_rotation));

  View view;
  view.clip_from_head =
      glm::mat4(clip_from_eye * eye_from_world * glm::dmat4(glm::transpose(head_from_world)));
  view.eye_m = glm::vec3(head_from_world * eye);
  view.up = glm::vec3(head_from_world * world_up);
  view.target_px = glm::vec2(target_px);
  view.focal_px = static_cast<float>(0.5 * target_px.y / std::tan(0.5 * camera.fov_y_rad));
  view.near_m = static_cast<float>(near_m);
  view.far_m = static_cast<float>(distance_m + kFarPlaneM);
  view.target_distance_m = static_cast<float>(distance_m);
  return view;
}

}  // namespace strandcast

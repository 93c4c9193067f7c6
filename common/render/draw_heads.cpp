#include "common/render/draw_heads.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace strandcast {
namespace {

/// What is to be seen around the joint of a head.
constexpr double kHeadRoomM = 0.2;
/// A camera that looks so nearly straight up or down has no upwards in its picture.
constexpr double kLevelShare = 0.05;
/// Heads that are farther apart than so are not all shown.
constexpr double kMostRoom = 100.0;

void add(RenderProfile& sum, const RenderProfile& one) {
  sum.total_ms += one.total_ms;
  sum.drawn_strands += one.drawn_strands;
  sum.drawn_segments += one.drawn_segments;
  sum.is_whole = sum.is_whole && one.is_whole;
  sum.left_out_fragments += one.left_out_fragments;
  sum.left_out_strands += one.left_out_strands;
  sum.unusable_segments += one.unusable_segments;
}

}  // namespace

glm::dvec3 middle_of(std::span<const PlacedHead> heads) {
  glm::dvec3 sum_m(0.0);
  for (const PlacedHead& head : heads) sum_m += head.strands->world_from_head.position_m;
  return sum_m / static_cast<double>(heads.size());
}

CameraDesc camera_from_head(const CameraDesc& camera, const glm::dvec3& middle_m, const glm::dvec3& head_m) {
  CameraDesc seen = camera;
  seen.target_m = glm::vec3(glm::dvec3(camera.target_m) + (middle_m - head_m));
  return seen;
}

double room_factor(std::span<const PlacedHead> heads, const CameraDesc& of_scene, RenderSize size) {
  const glm::dvec3 offset_m(of_scene.offset_m);
  const double distance_m = glm::length(offset_m);
  if (heads.size() < 2 || !(distance_m > 0.0) || size.height == 0) return 1.0;
  const glm::dvec3 forward = -offset_m / distance_m;
  // Straight from above or below, what is beside the target may be anywhere in the picture.
  const glm::dvec3 upward = glm::dvec3(0.0, 1.0, 0.0) - forward * forward.y;
  const bool has_up = glm::length(upward) > kLevelShare;
  const double slope_y = std::tan(0.5 * of_scene.fov_y_rad);
  const double slope_x = slope_y * size.width / size.height;
  const glm::dvec3 target_m = middle_of(heads) + glm::dvec3(of_scene.target_m);
  double needed_m = distance_m;
  for (const PlacedHead& head : heads) {
    const glm::dvec3 from_target_m = head.strands->world_from_head.position_m - target_m;
    const double depth_m = glm::dot(from_target_m, forward);
    const double beside_m = glm::length(from_target_m - forward * depth_m);
    const double y_m = has_up ? std::abs(glm::dot(from_target_m, glm::normalize(upward))) : beside_m;
    const double x_m = has_up ? std::sqrt(std::max(beside_m * beside_m - y_m * y_m, 0.0)) : beside_m;
    const double least_m = std::max((x_m + kHeadRoomM) / slope_x, (y_m + kHeadRoomM) / slope_y);
    needed_m = std::max(needed_m, least_m - depth_m);
  }
  return std::min(needed_m / distance_m, kMostRoom);
}

Result<HeadsPicture> draw_heads(std::span<const PlacedHead> heads, const HeadsCamera& from, RenderSize size,
                                const DrawTerms& terms) {
  const glm::dvec3 middle_m = middle_of(heads);
  CameraDesc camera = from.own;
  if (heads.size() > 1) camera.offset_m *= static_cast<float>(room_factor(heads, from.of_scene, size));
  const glm::dvec3 eye_m = middle_m + glm::dvec3(camera.target_m) + glm::dvec3(camera.offset_m);
  const auto distance_m = [&](const PlacedHead& head) {
    return glm::distance(eye_m, head.strands->world_from_head.position_m);
  };
  std::vector<PlacedHead> farthest_first(heads.begin(), heads.end());
  std::stable_sort(farthest_first.begin(), farthest_first.end(),
                   [&](const PlacedHead& a, const PlacedHead& b) { return distance_m(a) > distance_m(b); });
  HeadsPicture picture;
  DrawTerms over = terms;
  for (const PlacedHead& head : farthest_first) {
    const glm::dvec3& head_m = head.strands->world_from_head.position_m;
    RETURN_IF_ERROR(
        head.renderer->draw(*head.strands, camera_from_head(camera, middle_m, head_m), size, over));
    add(picture.profile, head.renderer->profile());
    if (!picture.profile.is_whole) return HeadsPicture{{}, picture.profile};
    picture.image = head.renderer->read_image();
    over.backdrop = &picture.image;
  }
  return picture;
}

}  // namespace strandcast

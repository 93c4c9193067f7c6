#include "common/render/draw_heads.h"

#include <algorithm>
#include <vector>

namespace strandcast {
namespace {

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

Result<HeadsPicture> draw_heads(std::span<const PlacedHead> heads, const CameraDesc& camera, RenderSize size,
                                const DrawTerms& terms) {
  const glm::dvec3 middle_m = middle_of(heads);
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

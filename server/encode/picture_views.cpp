#include "server/encode/picture_views.h"

#include <algorithm>
#include <cmath>

namespace strandcast {
namespace {

constexpr float kMinFovRad = 0.01f;
constexpr float kMaxFovRad = 3.0f;
constexpr float kMinViewDistanceM = 1e-3f;
constexpr float kMaxViewDistanceM = 1e4f;
constexpr int kMaxQuality = 100;
constexpr uint32_t kMaxPictureRateDivisor = 64;

bool is_finite(const glm::vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

}  // namespace

bool operator==(const PictureView& a, const PictureView& b) {
  return look_alike(a, b) && a.quality == b.quality && a.rate_divisor == b.rate_divisor && a.codec == b.codec;
}

bool look_alike(const PictureView& a, const PictureView& b) {
  return a.camera == b.camera && a.size.width == b.size.width && a.size.height == b.size.height;
}

Status validate(const PictureView& view) {
  const auto [width, height] = view.size;
  if (width < kMinPictureSide || height < kMinPictureSide || width > kMaxPictureWidth ||
      height > kMaxPictureHeight)
    return make_error(ErrorCode::BadInput, "picture size {} x {} is not within {} x {} to {} x {}", width,
                      height, kMinPictureSide, kMinPictureSide, kMaxPictureWidth, kMaxPictureHeight);
  if (view.quality < 1 || view.quality > kMaxQuality)
    return make_error(ErrorCode::BadInput, "picture quality {} is not within 1 to {}", view.quality,
                      kMaxQuality);
  if (view.rate_divisor < 1 || view.rate_divisor > kMaxPictureRateDivisor)
    return make_error(ErrorCode::BadInput, "every {}th picture is not within 1 to {}", view.rate_divisor,
                      kMaxPictureRateDivisor);
  const CameraDesc& camera = view.camera;
  if (!is_finite(camera.offset_m) || !is_finite(camera.target_m) ||
      glm::length(camera.target_m) > kMaxViewDistanceM)
    return make_error(ErrorCode::BadInput, "the camera's offset or target is no usable place");
  const float distance_m = glm::length(camera.offset_m);
  if (!(distance_m >= kMinViewDistanceM && distance_m <= kMaxViewDistanceM))
    return make_error(ErrorCode::BadInput, "the camera is {} m from what it looks at, not within {} to {}",
                      distance_m, kMinViewDistanceM, kMaxViewDistanceM);
  if (!(camera.fov_y_rad >= kMinFovRad && camera.fov_y_rad <= kMaxFovRad))
    return make_error(ErrorCode::BadInput, "the camera's field of view {} rad is not within {} to {}",
                      camera.fov_y_rad, kMinFovRad, kMaxFovRad);
  return {};
}

size_t PictureViews::members(uint32_t picture_class) const {
  return static_cast<size_t>(std::count_if(class_of_viewer_.begin(), class_of_viewer_.end(),
                                           [&](const auto& entry) { return entry.second == picture_class; }));
}

Result<uint32_t> PictureViews::assign(uint64_t viewer, const PictureView& view) {
  RETURN_IF_ERROR(validate(view));
  const auto held = class_of_viewer_.find(viewer);
  const bool is_alone = held != class_of_viewer_.end() && members(held->second) == 1;
  for (const auto& [picture_class, other] : view_of_class_) {
    if (!(other == view)) continue;
    const uint32_t joined = picture_class;
    if (is_alone && held->second != joined) view_of_class_.erase(held->second);
    class_of_viewer_[viewer] = joined;
    return joined;
  }
  const uint32_t own_class = is_alone ? held->second : 0;
  if (!has_room(view, own_class))
    return make_error(ErrorCode::LimitExceeded,
                      "{} different pictures are being drawn already; ask for one of them or for strands",
                      kMaxPictureViews);
  if (is_alone) {
    view_of_class_[own_class] = view;
    return own_class;
  }
  view_of_class_[next_class_] = view;
  class_of_viewer_[viewer] = next_class_;
  return next_class_++;
}

/// Whether the view can be drawn and encoded besides all classes but `left_class`.
bool PictureViews::has_room(const PictureView& view, uint32_t left_class) const {
  std::vector<PictureView> drawn = {view};
  size_t classes = 1;
  for (const auto& [picture_class, other] : view_of_class_) {
    if (picture_class == left_class) continue;
    ++classes;
    const auto is_same = [&](const PictureView& one) { return look_alike(one, other); };
    if (std::none_of(drawn.begin(), drawn.end(), is_same)) drawn.push_back(other);
  }
  return drawn.size() <= kMaxPictureViews && classes <= kMaxPictureClasses;
}

uint32_t PictureViews::class_of(uint64_t viewer) const {
  const auto found = class_of_viewer_.find(viewer);
  return found != class_of_viewer_.end() ? found->second : 0;
}

void PictureViews::remove(uint64_t viewer) {
  const auto held = class_of_viewer_.find(viewer);
  if (held == class_of_viewer_.end()) return;
  if (members(held->second) == 1) view_of_class_.erase(held->second);
  class_of_viewer_.erase(held);
}

std::map<uint32_t, PictureView> PictureViews::views() const {
  return view_of_class_;
}

}  // namespace strandcast

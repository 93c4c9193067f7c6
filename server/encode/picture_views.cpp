#include "server/encode/picture_views.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/base/check.h"

namespace strandcast {
namespace {

constexpr float kMinFovRad = 0.01f;
constexpr float kMaxFovRad = 3.0f;
constexpr float kMinViewDistanceM = 1e-3f;
constexpr float kMaxViewDistanceM = 1e4f;
constexpr int kMaxQuality = 100;
constexpr uint32_t kMaxPictureRateDivisor = 64;
/// H.264 has even sizes only, and the ladder halves them.
constexpr uint32_t kFittedSideStep = 4;

bool is_finite(const glm::vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

uint64_t pixels_of(const PictureView& view) {
  return uint64_t{view.size.width} * view.size.height;
}

std::string pixels_text(const char* whose, uint64_t wanted, uint64_t limit) {
  constexpr double kMillion = 1e6;
  return fmt::format("{} would have {:.1f} million pixels of pictures, and may have {:.1f}", whose,
                     static_cast<double>(wanted) / kMillion, static_cast<double>(limit) / kMillion);
}

Error no_room(const std::string& why) {
  return make_error(
      ErrorCode::Unavailable,
      "{}: ask for the scene's own picture, for a smaller one or for strands, or try again later", why);
}

}  // namespace

RenderSize fit_picture(const RenderSize& size, const PictureBudget& budget) {
  const uint64_t pixels = uint64_t{size.width} * size.height;
  if (pixels <= budget.picture_pixels) return size;
  const double scale = std::sqrt(static_cast<double>(budget.picture_pixels) / static_cast<double>(pixels));
  const auto fit_side = [&](uint32_t side) {
    const auto fitted = static_cast<uint32_t>(scale * side);
    return std::max(fitted - fitted % kFittedSideStep, kMinPictureSide);
  };
  return {fit_side(size.width), fit_side(size.height)};
}

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

PictureViews::PictureViews(PictureView reserved, const PictureBudget& budget)
    : reserved_size_(reserved.size), reserved_(std::move(reserved)) {
  set_budget(budget);
}

void PictureViews::set_budget(const PictureBudget& budget) {
  CHECK(view_of_class_.empty());
  budget_ = budget;
  reserved_.size = fit_picture(reserved_size_, budget);
}

size_t PictureViews::member_count(uint32_t picture_class) const {
  return static_cast<size_t>(std::count_if(members_.begin(), members_.end(), [&](const auto& entry) {
    return entry.second.picture_class == picture_class;
  }));
}

/// The scene's own picture, in any codec.
bool PictureViews::is_reserved(const PictureView& view) const {
  PictureView same = view;
  same.codec = reserved_.codec;
  return same == reserved_;
}

Result<uint32_t> PictureViews::assign(const PictureOwner& owner, const PictureView& view) {
  RETURN_IF_ERROR(validate(view));
  if (pixels_of(view) > budget_.picture_pixels)
    return make_error(ErrorCode::BadInput, "a picture of {} x {} pixels is more than is drawn here",
                      view.size.width, view.size.height);
  const auto held = members_.find(owner.viewer);
  const uint32_t held_class = held != members_.end() ? held->second.picture_class : 0;
  const bool is_alone = held_class != 0 && member_count(held_class) == 1;
  const auto equal = std::find_if(view_of_class_.begin(), view_of_class_.end(),
                                  [&](const auto& entry) { return entry.second == view; });
  if (equal != view_of_class_.end()) {
    const uint32_t joined = equal->first;
    if (is_alone && held_class != joined) view_of_class_.erase(held_class);
    members_[owner.viewer] = {owner, joined};
    return joined;
  }
  RETURN_IF_ERROR(check_room(owner, view, is_alone ? held_class : 0));
  const uint32_t own_class = is_alone ? held_class : next_class_++;
  view_of_class_[own_class] = view;
  members_[owner.viewer] = {owner, own_class};
  return own_class;
}

/// Of this view and of all classes that count and are not reserved.
template <class IsCounted>
PictureUse PictureViews::use_with(const PictureView& view, IsCounted is_counted) const {
  std::vector<PictureView> drawn = {view};
  PictureUse use{0, 1, pixels_of(view)};
  for (const auto& [picture_class, other] : view_of_class_) {
    if (is_reserved(other) || !is_counted(picture_class)) continue;
    ++use.classes;
    use.pixels += pixels_of(other);
    const auto is_same = [&](const PictureView& one) { return look_alike(one, other); };
    if (std::none_of(drawn.begin(), drawn.end(), is_same)) drawn.push_back(other);
  }
  use.views = drawn.size();
  return use;
}

/// There always is, but after its camera was moved while others stayed.
Status PictureViews::check_reserved_room(const PictureView& view, uint32_t left_class) const {
  PictureUse all = use_with(view, [&](uint32_t one) { return one != left_class; });
  for (const auto& [picture_class, other] : view_of_class_) {
    if (!is_reserved(other) || picture_class == left_class) continue;
    ++all.classes;
    all.pixels += pixels_of(other);
  }
  if (all.views > kMaxPictureViews || all.classes > kMaxPictureClasses)
    return no_room(fmt::format("{} different pictures are being drawn already", all.classes - 1));
  const uint64_t most_pixels = budget_.all_pixels + kReservedPictureClasses * budget_.picture_pixels;
  if (all.pixels > most_pixels) return no_room(pixels_text("all together", all.pixels, most_pixels));
  return {};
}

/// Whether the view can be drawn and encoded besides all classes but `left_class`, and is within the share of
/// its owner. A class that several share counts for each of their addresses.
Status PictureViews::check_room(const PictureOwner& owner, const PictureView& view,
                                uint32_t left_class) const {
  if (is_reserved(view)) return check_reserved_room(view, left_class);
  const auto has_member = [&](uint32_t picture_class, auto is_one) {
    return std::any_of(members_.begin(), members_.end(), [&](const auto& entry) {
      return entry.second.picture_class == picture_class && is_one(entry.second.owner);
    });
  };
  const PictureUse all = use_with(view, [&](uint32_t one) { return one != left_class; });
  const PictureUse of_viewers = use_with(view, [&](uint32_t one) {
    return one != left_class && !has_member(one, [](const auto& other) { return other.is_controller; });
  });
  const PictureUse of_peer = use_with(view, [&](uint32_t one) {
    return one != left_class && has_member(one, [&](const auto& other) { return other.peer == owner.peer; });
  });
  // The scene's own view has its place among the views.
  if (all.views > kMaxPictureViews - 1 || all.classes > kMaxPictureClasses - kReservedPictureClasses)
    return no_room(fmt::format("{} different pictures are being drawn already", all.classes - 1));
  if (of_peer.views > kMaxPictureViewsOfPeer || of_peer.classes > kMaxPictureClassesOfPeer)
    return no_room(
        fmt::format("{} different pictures are being drawn for this address already", of_peer.classes - 1));
  if (of_peer.pixels > budget_.peer_pixels())
    return no_room(pixels_text("one address", of_peer.pixels, budget_.peer_pixels()));
  if (!owner.is_controller && of_viewers.pixels > budget_.viewer_pixels())
    return no_room(pixels_text("viewers", of_viewers.pixels, budget_.viewer_pixels()));
  if (all.pixels > budget_.all_pixels)
    return no_room(pixels_text("all together", all.pixels, budget_.all_pixels));
  return {};
}

uint32_t PictureViews::class_of(uint64_t viewer) const {
  const auto found = members_.find(viewer);
  return found != members_.end() ? found->second.picture_class : 0;
}

void PictureViews::remove(uint64_t viewer) {
  const auto held = members_.find(viewer);
  if (held == members_.end()) return;
  if (member_count(held->second.picture_class) == 1) view_of_class_.erase(held->second.picture_class);
  members_.erase(held);
}

std::map<uint32_t, PictureView> PictureViews::views() const {
  return view_of_class_;
}

}  // namespace strandcast

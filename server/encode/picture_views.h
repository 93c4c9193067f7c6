// PictureViews: decides which pictures the server draws. Viewers with equal camera, size, quality, rate and
// codec share a picture class, which is encoded once. Classes with equal camera and size are drawn once.
// Their number is limited because each drawing costs a whole rendered frame, and no client can take all of
// them. Pure bookkeeping, one thread.
#pragma once

#include <cstdint>
#include <iterator>
#include <map>
#include <string>
#include <utility>

#include "common/base/result.h"
#include "common/pictures/picture.h"
#include "common/render/renderer.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

inline constexpr size_t kMaxPictureViews = 8;     // different cameras and sizes
inline constexpr size_t kMaxPictureClasses = 16;  // encoders
/// Classes reserved for the scene's own picture, one for each codec; no viewer's wishes can take them.
inline constexpr size_t kReservedPictureClasses = std::size(kPictureCodecs);
/// Limits of one address, whatever the roles of its sessions.
inline constexpr size_t kMaxPictureViewsOfPeer = kMaxPictureViews / 2;
inline constexpr size_t kMaxPictureClassesOfPeer = kMaxPictureClasses / 2;

/// Memory per pixel while drawing: 2 x 2 samples of colour and depth, and the driver's copies of the picture.
/// Only one view is drawn at a time. Measured with llvmpipe.
inline constexpr uint64_t kDrawnPixelBytes = 110;
/// Memory per pixel of each class for its picture and its encoder's references; the latter are estimated at
/// 20 to 40 by codec.
inline constexpr uint64_t kClassPixelBytes = 40;

/// Numbers of pixels that a device can draw.
struct PictureBudget {
  uint64_t picture_pixels = 0;  // of one picture; a larger one is drawn smaller
  uint64_t all_pixels = 0;      // of all classes but the reserved ones
  /// Returns the pixels that viewers may take together; the rest is kept for controllers.
  constexpr uint64_t viewer_pixels() const { return all_pixels * 3 / 4; }
  /// Returns the pixels that one address may take, whatever the roles of its sessions.
  constexpr uint64_t peer_pixels() const { return all_pixels / 2; }
  /// Returns the estimated memory of the whole budget, including the reserved classes.
  constexpr uint64_t most_bytes() const {
    return picture_pixels * kDrawnPixelBytes +
           (all_pixels + kReservedPictureClasses * picture_pixels) * kClassPixelBytes;
  }
};

/// Budget with a GPU: every permitted picture, and two of the largest at once.
inline constexpr PictureBudget kHardwareBudget{uint64_t{kMaxPictureWidth} * kMaxPictureHeight,
                                               2 * uint64_t{kMaxPictureWidth} * kMaxPictureHeight};
/// Budget without a GPU, where the processor draws in its own memory and finishes what it has begun: pictures
/// that take a fraction of a second.
inline constexpr PictureBudget kSoftwareBudget{1280 * 720, 6 * 1280 * 720};

/// Returns `size`, or a smaller size of the same shape if it exceeds the budget; its sides are then multiples
/// of 4.
RenderSize fit_picture(const RenderSize& size, const PictureBudget& budget);

struct PictureView {
  CameraDesc camera;
  RenderSize size;
  int quality = 80;           // 1 .. 100, as in JPEG
  uint32_t rate_divisor = 1;  // every so many pictures
  PictureCodec codec = PictureCodec::Jpeg;
};

bool operator==(const PictureView& a, const PictureView& b);
/// Returns whether one drawing serves both views.
bool look_alike(const PictureView& a, const PictureView& b);

/// Returns BadInput for a size or quality out of range, and for a camera that is not finite or sits on its
/// target.
Status validate(const PictureView& view);

/// The viewer that wants a picture, and the properties by which shares are counted.
struct PictureOwner {
  uint64_t viewer = 0;
  std::string peer;            // address, or what counts as one
  bool is_controller = false;  // or more
};

/// Resources that a set of classes needs, without the reserved ones.
struct PictureUse {
  size_t views = 0;
  size_t classes = 0;
  uint64_t pixels = 0;
};

class PictureViews {
 public:
  /// Makes an empty set; `reserved` is the scene's own picture, for which there is always room in any codec.
  PictureViews(PictureView reserved, const PictureBudget& budget);
  const PictureBudget& budget() const { return budget_; }
  /// Sets the budget; call it before the first class.
  void set_budget(const PictureBudget& budget);

  /// Changes the camera of the scene's own picture. Viewers of the previous one keep it and then count like
  /// others. The scene's picture has room while all views are within the limits.
  void set_reserved_camera(const CameraDesc& camera) { reserved_.camera = camera; }

  /// Assigns a viewer the class of an equal view, or a new one. Call it again when the camera changes: a
  /// viewer alone in its class keeps the class. Unavailable if a limit is reached; the viewer then keeps what
  /// it had. BadInput for a view that cannot be drawn or exceeds the budget.
  Result<uint32_t> assign(const PictureOwner& owner, const PictureView& view);
  /// Removes a viewer; ignored if it is unknown.
  void remove(uint64_t viewer);
  /// Returns a viewer's class; 0 for unknown viewers.
  uint32_t class_of(uint64_t viewer) const;
  /// Returns the views by class; class numbers start at 1 and are never reused.
  std::map<uint32_t, PictureView> views() const;
  size_t viewer_count() const { return members_.size(); }

 private:
  struct Member {
    PictureOwner owner;
    uint32_t picture_class = 0;
  };
  bool is_reserved(const PictureView& view) const;
  size_t member_count(uint32_t picture_class) const;
  template <class IsCounted>
  PictureUse use_with(const PictureView& view, IsCounted is_counted) const;
  Status check_reserved_room(const PictureView& view, uint32_t left_class) const;
  Status check_room(const PictureOwner& owner, const PictureView& view, uint32_t left_class) const;

  const RenderSize reserved_size_;  // as wished for
  PictureView reserved_;
  PictureBudget budget_;
  std::map<uint32_t, PictureView> view_of_class_;
  std::map<uint64_t, Member> members_;  // by viewer
  uint32_t next_class_ = 1;
};

}  // namespace strandcast

// PictureViews: which pictures the server draws. Viewers with the same camera, size, quality, rate and codec
// share one picture class, which is encoded once; classes with the same camera and size are drawn once. There
// are few, because each drawing costs a whole rendered frame, and nobody can take them all. Pure bookkeeping,
// one thread.
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
/// Kept for the scene's own picture: one class for each codec. Nobody's wishes take it from the others.
inline constexpr size_t kReservedPictureClasses = std::size(kPictureCodecs);
/// What one address may take, whatever its roles.
inline constexpr size_t kMaxPictureViewsOfPeer = kMaxPictureViews / 2;
inline constexpr size_t kMaxPictureClassesOfPeer = kMaxPictureClasses / 2;

/// What a pixel takes while it is drawn: 2 x 2 samples of colour and depth, and the driver's copies of the
/// picture. Of the one view that is being drawn. Measured with llvmpipe.
inline constexpr uint64_t kDrawnPixelBytes = 110;
/// And in each class: its picture and what its encoder refers to, by estimate 20 to 40 by codec.
inline constexpr uint64_t kClassPixelBytes = 40;

/// How many pixels a device is good for.
struct PictureBudget {
  uint64_t picture_pixels = 0;  // of one picture; a larger one is drawn smaller
  uint64_t all_pixels = 0;      // of all classes but the reserved ones
  /// Of those, what viewers may take; the rest is kept for whoever controls.
  constexpr uint64_t viewer_pixels() const { return all_pixels * 3 / 4; }
  /// What one address may take, whatever its roles.
  constexpr uint64_t peer_pixels() const { return all_pixels / 2; }
  /// What all this takes, the reserved classes included, by estimate.
  constexpr uint64_t most_bytes() const {
    return picture_pixels * kDrawnPixelBytes +
           (all_pixels + kReservedPictureClasses * picture_pixels) * kClassPixelBytes;
  }
};

/// Every picture that can be asked for, and two of the largest at once.
inline constexpr PictureBudget kHardwareBudget{uint64_t{kMaxPictureWidth} * kMaxPictureHeight,
                                               2 * uint64_t{kMaxPictureWidth} * kMaxPictureHeight};
/// Without a GPU the processor draws, in its own memory, and finishes what it has begun: pictures are no
/// larger than what it draws in a fraction of a second.
inline constexpr PictureBudget kSoftwareBudget{1280 * 720, 6 * 1280 * 720};

/// The size, or where it has more pixels a smaller one of that shape. Its sides are then multiples of 4.
RenderSize fit_picture(const RenderSize& size, const PictureBudget& budget);

struct PictureView {
  CameraDesc camera;
  RenderSize size;
  int quality = 80;           // 1 .. 100, as in JPEG
  uint32_t rate_divisor = 1;  // every so many pictures
  PictureCodec codec = PictureCodec::Jpeg;
};

bool operator==(const PictureView& a, const PictureView& b);
/// Whether one drawing serves both.
bool look_alike(const PictureView& a, const PictureView& b);

/// BadInput for a size or quality out of range and a camera that is not finite or looks at its own place.
Status validate(const PictureView& view);

/// Whose wish a picture is: what the shares go by.
struct PictureOwner {
  uint64_t viewer = 0;
  std::string peer;            // address, or what counts as one
  bool is_controller = false;  // or more
};

/// What some classes need; the reserved ones are left out.
struct PictureUse {
  size_t views = 0;
  size_t classes = 0;
  uint64_t pixels = 0;
};

class PictureViews {
 public:
  /// `reserved` is the scene's own picture: in any codec there is always room for it.
  PictureViews(PictureView reserved, const PictureBudget& budget);
  const PictureBudget& budget() const { return budget_; }
  /// Before the first class.
  void set_budget(const PictureBudget& budget);

  /// The scene's own picture is taken from here from now on. Whoever has one from where it was keeps it, and
  /// counts like others then: the scene's own has room while all of them are within the limits.
  void set_reserved_camera(const CameraDesc& camera) { reserved_.camera = camera; }

  /// Gives the viewer a class: that of an equal view, else a new one. Call again when its camera changes: a
  /// viewer alone in its class keeps the class. Unavailable while a limit above is reached, and the viewer
  /// then keeps what it had; BadInput for a view that cannot be drawn, or has not been made to fit.
  Result<uint32_t> assign(const PictureOwner& owner, const PictureView& view);
  /// Ignored for unknown viewers.
  void remove(uint64_t viewer);
  /// 0 for unknown viewers.
  uint32_t class_of(uint64_t viewer) const;
  /// By class; class numbers start at 1 and are never used again.
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

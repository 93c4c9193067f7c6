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
/// Pixels of all classes together. Each class keeps its picture and what its encoder refers to, by estimate
/// 20 to 40 bytes a pixel; drawing it without a GPU takes about 100 more (2 x 2 samples of colour and depth).
inline constexpr uint64_t kLargestPicturePixels = uint64_t{kMaxPictureWidth} * kMaxPictureHeight;
inline constexpr uint64_t kMaxPicturePixels = 2 * kLargestPicturePixels;
/// Of those, what viewers may take; the rest is kept for whoever controls.
inline constexpr uint64_t kMaxViewerPixels = kMaxPicturePixels * 3 / 4;
/// What one address may take, whatever its roles.
inline constexpr size_t kMaxPictureViewsOfPeer = kMaxPictureViews / 2;
inline constexpr size_t kMaxPictureClassesOfPeer = kMaxPictureClasses / 2;
inline constexpr uint64_t kMaxPeerPixels = kMaxPicturePixels / 2;
/// Kept for the scene's own picture: one class for each codec. Nobody's wishes take it from the others.
inline constexpr size_t kReservedPictureClasses = std::size(kPictureCodecs);

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
  explicit PictureViews(PictureView reserved) : reserved_(std::move(reserved)) {}

  /// Gives the viewer a class: that of an equal view, else a new one. Call again when its camera changes: a
  /// viewer alone in its class keeps the class. Unavailable while a limit above is reached, and the viewer
  /// then keeps what it had; BadInput for a view that cannot be drawn.
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
  Status check_room(const PictureOwner& owner, const PictureView& view, uint32_t left_class) const;

  const PictureView reserved_;
  std::map<uint32_t, PictureView> view_of_class_;
  std::map<uint64_t, Member> members_;  // by viewer
  uint32_t next_class_ = 1;
};

}  // namespace strandcast

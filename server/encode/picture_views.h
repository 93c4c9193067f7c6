// PictureViews: which pictures the server draws. Viewers with the same camera, size, quality, rate and codec
// share one picture class, which is encoded once; classes with the same camera and size are drawn once. There
// are few, because each drawing costs a whole rendered frame. Pure bookkeeping, one thread.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "common/base/result.h"
#include "common/pictures/picture.h"
#include "common/render/renderer.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

inline constexpr size_t kMaxPictureViews = 4;     // different cameras and sizes
inline constexpr size_t kMaxPictureClasses = 16;  // encoders

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

class PictureViews {
 public:
  /// Gives the viewer a class: that of an equal view, else a new one. Call again when its camera changes: a
  /// viewer alone in its class keeps the class. LimitExceeded when kMaxPictureViews others or
  /// kMaxPictureClasses are in use; the viewer then keeps what it had.
  Result<uint32_t> assign(uint64_t viewer, const PictureView& view);
  /// Ignored for unknown viewers.
  void remove(uint64_t viewer);
  /// 0 for unknown viewers.
  uint32_t class_of(uint64_t viewer) const;
  /// By class; class numbers start at 1 and are never used again.
  std::map<uint32_t, PictureView> views() const;
  size_t viewer_count() const { return class_of_viewer_.size(); }

 private:
  size_t members(uint32_t picture_class) const;
  bool has_room(const PictureView& view, uint32_t left_class) const;

  std::map<uint32_t, PictureView> view_of_class_;
  std::map<uint64_t, uint32_t> class_of_viewer_;
  uint32_t next_class_ = 1;
};

}  // namespace strandcast

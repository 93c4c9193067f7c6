// PictureViews: which pictures the server draws. Viewers with the same camera, size and quality share one
// picture class; there are few classes, because each costs a whole rendered frame. Pure bookkeeping, one
// thread.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "common/base/result.h"
#include "common/render/renderer.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

inline constexpr size_t kMaxPictureViews = 4;
inline constexpr uint32_t kMinPictureSide = 16;
inline constexpr uint32_t kMaxPictureWidth = 3840;
inline constexpr uint32_t kMaxPictureHeight = 2160;

struct PictureView {
  CameraDesc camera;
  RenderSize size;
  int jpeg_quality = 80;  // 1 .. 100
};

bool operator==(const PictureView& a, const PictureView& b);

/// BadInput for a size or quality out of range and a camera that is not finite or looks at its own place.
Status validate(const PictureView& view);

class PictureViews {
 public:
  /// Gives the viewer a class: that of an equal view, else a new one. Call again when its camera changes: a
  /// viewer alone in its class keeps the class. LimitExceeded when kMaxPictureViews others are in use; the
  /// viewer then keeps what it had.
  Result<uint32_t> assign(uint64_t viewer, const PictureView& view);
  /// Ignored for unknown viewers.
  void remove(uint64_t viewer);
  /// By class; class numbers start at 1 and are never used again.
  std::map<uint32_t, PictureView> views() const;
  size_t viewer_count() const { return class_of_viewer_.size(); }

 private:
  size_t members(uint32_t picture_class) const;

  std::map<uint32_t, PictureView> view_of_class_;
  std::map<uint64_t, uint32_t> class_of_viewer_;
  uint32_t next_class_ = 1;
};

}  // namespace strandcast

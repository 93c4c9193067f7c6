// ViewPainter: pictures of a recording's strands as a viewer draws them, in tiles on the processors, with the
// pixels that are hair. One thread.
#pragma once

#include <cstdint>
#include <memory>

#include "common/base/picture_size.h"
#include "common/pictures/picture_error.h"
#include "common/render/render_device.h"
#include "common/scene/scene_desc.h"
#include "common/strands/posed_strands.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

/// A picture and which of its pixels show hair.
struct HairPicture {
  Image image;
  PictureMask hair;
};

/// The camera from so far away, in the same direction.
CameraDesc camera_at(CameraDesc camera, double distance_m);
/// Pixels that are in one mask or the other.
PictureMask either(PictureMask a, const PictureMask& b);

class ViewPainter {
 public:
  /// Loads the scene's hair and head.
  static Result<std::unique_ptr<ViewPainter>> make(const SceneDesc& scene, RenderSize size);
  Result<Image> image(const PosedStrands& strands, double distance_m, DebugView debug_view = DebugView::None);
  /// Hair is what changes when strands have the colours of their directions. A picture of the bald head would
  /// say the same of skin in the hair's shadow.
  Result<HairPicture> hair(const PosedStrands& strands, double distance_m);
  uint64_t drawn_strands() const { return renderer_->profile().drawn_strands; }

 private:
  ViewPainter(const SceneDesc& scene, RenderSize size) : scene_(scene), size_(size) {}

  SceneDesc scene_;
  RenderSize size_;
  SceneAsset asset_;
  std::unique_ptr<RenderDevice> device_;
  std::unique_ptr<Renderer> renderer_;
};

}  // namespace strandcast

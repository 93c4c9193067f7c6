// ViewPainter: draws pictures of a recording's strands as a viewer does, in tiles on the processors, and
// finds the pixels that are hair. One thread.
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

/// A picture, and a mask of the pixels that show hair.
struct HairPicture {
  Image image;
  PictureMask hair;
};

/// Returns the camera moved to this distance in the same direction.
CameraDesc camera_at(CameraDesc camera, double distance_m);
/// Returns the union of two masks.
PictureMask either(PictureMask a, const PictureMask& b);

class ViewPainter {
 public:
  /// Loads the scene's hair and head and makes the painter.
  static Result<std::unique_ptr<ViewPainter>> make(const SceneDesc& scene, RenderSize size);
  Result<Image> image(const PosedStrands& strands, double distance_m, DebugView debug_view = DebugView::None);
  /// Draws a picture and its mask. Hair is what changes if strands are coloured by their directions; a
  /// comparison with the bald head would include skin in the hair's shadow.
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

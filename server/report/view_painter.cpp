#include "server/report/view_painter.h"

#include <utility>

#include "common/groom/groom_asset.h"
#include "server/scene/scene_content.h"

namespace strandcast {

CameraDesc camera_at(CameraDesc camera, double distance_m) {
  camera.offset_m *= static_cast<float>(distance_m) / glm::length(camera.offset_m);
  return camera;
}

PictureMask either(PictureMask a, const PictureMask& b) {
  for (size_t i = 0; i < a.size(); ++i) a[i] |= b[i];
  return a;
}

Result<std::unique_ptr<ViewPainter>> ViewPainter::make(const SceneDesc& scene, RenderSize size) {
  auto painter = std::unique_ptr<ViewPainter>(new ViewPainter(scene, size));
  ASSIGN_OR_RETURN(const SceneContent content, load_scene_content(scene));
  painter->asset_ = make_scene_asset(content.groom, content.head);
  ASSIGN_OR_RETURN(painter->device_, RenderDevice::open({"tiles", "auto", {}}));
  ASSIGN_OR_RETURN(painter->renderer_, painter->device_->make_renderer(RendererKind::Tiles, painter->asset_,
                                                                       painter->scene_.look));
  return painter;
}

Result<Image> ViewPainter::image(const PosedStrands& strands, double distance_m, DebugView debug_view) {
  DrawTerms terms;
  terms.debug_view = debug_view;
  RETURN_IF_ERROR(renderer_->draw(strands, camera_at(scene_.camera, distance_m), size_, terms));
  return renderer_->read_image();
}

Result<HairPicture> ViewPainter::hair(const PosedStrands& strands, double distance_m) {
  ASSIGN_OR_RETURN(Image shown, image(strands, distance_m));
  ASSIGN_OR_RETURN(const Image other, image(strands, distance_m, DebugView::Tangents));
  PictureMask mask = mask_of(shown, other);
  return HairPicture{std::move(shown), std::move(mask)};
}

}  // namespace strandcast

// Flicker of hair that turns with its head, beside the same pictures supersampled.
#include <array>

#include "server/report/pictures_study.h"

namespace strandcast {
namespace {

constexpr uint32_t kSuper = 4;                    // samples along a pixel's side
constexpr double kTurnRadPerPicture = 0.0261799;  // 90 degrees a second at 60 Hz
constexpr int kPictures = 5;

/// Draws the view at one moment.
Result<Image> picture_at(double moment, const PosedStrands& strands, const SceneDesc& scene, RenderSize size,
                         const DrawTerms& terms, Renderer& renderer) {
  PosedStrands turned = strands;
  turned.world_from_head.rotation = glm::angleAxis(moment * kTurnRadPerPicture, glm::dvec3(0.0, 1.0, 0.0)) *
                                    strands.world_from_head.rotation;
  RETURN_IF_ERROR(renderer.draw(turned, scene.camera, size, terms));
  return renderer.read_image();
}

}  // namespace

Result<FlickerRow> measure_flicker(const TruthView& view, const PosedStrands& strands, const SceneDesc& scene,
                                   Renderer& renderer) {
  RETURN_IF_ERROR(renderer.set_look(scene.look));
  const RenderSize size{kTruthWidthPx, kTruthHeightPx};
  const RenderSize large{size.width * kSuper, size.height * kSuper};
  DrawTerms marked;
  marked.debug_view = DebugView::Tangents;
  std::vector<LightCells> ours;
  std::vector<LightCells> smooth;
  PictureMask hair(size_t{size.width} * size.height, 1);  // in all pictures
  for (int k = 0; k < kPictures; ++k) {
    ASSIGN_OR_RETURN(const Image shown, picture_at(k, strands, scene, size, {}, renderer));
    ASSIGN_OR_RETURN(const Image tangents, picture_at(k, strands, scene, size, marked, renderer));
    ASSIGN_OR_RETURN(const Image fine, picture_at(k, strands, scene, large, {}, renderer));
    const PictureMask here = mask_of(shown, tangents);
    for (size_t i = 0; i < hair.size(); ++i) hair[i] = hair[i] != 0 && here[i] != 0 ? 1 : 0;
    ours.push_back(cells_of(shown, 1));
    smooth.push_back(cells_of(fine, kSuper));
  }
  FlickerRow row{view.name()};
  for (int k = 0; k + 2 < kPictures; ++k) {
    ASSIGN_OR_RETURN(const double of_ours, restlessness({ours[k], ours[k + 1], ours[k + 2]}, hair));
    ASSIGN_OR_RETURN(const double of_smooth, restlessness({smooth[k], smooth[k + 1], smooth[k + 2]}, hair));
    row.ours += of_ours / (kPictures - 2);
    row.supersampled += of_smooth / (kPictures - 2);
  }
  return row;
}

}  // namespace strandcast

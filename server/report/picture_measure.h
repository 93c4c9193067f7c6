// Holds a picture against a path-traced truth. Both are reduced to cells, means of linear light over squares
// of pixels, because a path tracer's single pixels are noisy. Pure functions, any thread.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "common/base/result.h"
#include "common/pictures/image_codec.h"
#include "common/pictures/picture_error.h"

namespace strandcast {

/// Side of a cell in pixels.
inline constexpr uint32_t kCellPx = 4;

/// Mean linear light of each cell, top row first.
struct LightCells {
  uint32_t width = 0;
  uint32_t height = 0;
  std::vector<glm::vec3> light;  // (height x width)
};

/// Shares of each cell that hair and skin cover, 0..1.
struct CoverCells {
  uint32_t width = 0;
  uint32_t height = 0;
  std::vector<float> hair, skin;  // (height x width) each
};

/// Reduces a shown picture: undoes sRGB and tone curve (shaders/lib/tone.glsl), then takes means over squares
/// of `cell_px` pixels. Rest of a side that fills no cell is left out.
LightCells cells_of(const Image& shown, uint32_t cell_px = kCellPx);
/// Adds the background, as pictures have it, where neither hair nor skin covers a cell.
LightCells over_background(LightCells light, const CoverCells& cover, const glm::vec3& background);
/// Returns cells as a screen shows them, a square of pixels each.
Image shown_cells(const LightCells& cells);
/// Returns where `seen` is brighter (more than middle grey) and darker than `truth` on the screen, twofold.
Image shown_difference(const LightCells& seen, const LightCells& truth);

/// What hair looks like in one picture; luminance is linear.
struct HairFigures {
  glm::dvec3 mean{0.0};     // linear
  double luminance = 0.0;   // of the mean
  double contrast = 0.0;    // deviation of luminance over its mean
  double saturation = 0.0;  // 1 - least over most of the mean's colours
  double brightest = 0.0;   // mean luminance of the brightest hundredth of the cells
  double glow_place = 0.0;  // of the brightest row, 0 = top of the hair .. 1 = bottom
  double glow_width = 0.0;  // share of the rows above the middle between the brightest and the median one
};
/// `picture` and `cover` have one size; cells that hair covers by nine tenths count. BadInput if none is.
Result<HairFigures> hair_figures(const LightCells& picture, const CoverCells& cover);

/// How far a picture is from its truth.
struct CellError {
  uint32_t cells = 0;     // that count; the others are 0 where there is none
  glm::dvec3 ratio{0.0};  // of the mean linear light, seen over true
  double luminance_ratio = 0.0;
  double psnr_db = 0.0;  // of what a screen shows; infinite where there is no difference
  double ssim = 0.0;     // of shown luminance, Gaussian of 1.5 cells (Wang et al. 2004)
};
enum class CellPart { Hair, Skin };
/// Compares cells that hair covers by half, or that skin covers whole. BadInput for sizes that differ.
Result<CellError> cell_error(const LightCells& seen, const LightCells& truth, const CoverCells& cover,
                             CellPart part);

/// How restless three pictures at equal steps in time are: root mean square, over the cells that count in
/// `mask`, of the second difference of shown luminance. Light that changes evenly gives 0. BadInput for sizes
/// that differ.
Result<double> restlessness(const std::array<LightCells, 3>& pictures, const PictureMask& mask);

}  // namespace strandcast

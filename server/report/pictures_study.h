// What strandcast-report pictures measures: our pictures, and those of every method of shading, beside truths
// by a path tracer, kept ones or new. Same strands, camera and lights. One thread.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/render/render_device.h"
#include "server/report/cycles_run.h"
#include "server/report/picture_measure.h"
#include "server/report/truth_views.h"

namespace strandcast {

struct PicturesDesc {
  std::filesystem::path truths = default_truth_folder();
  std::filesystem::path scratch;   // folder for Blender's files, where it runs
  std::optional<SceneDesc> scene;  // of other hair than the built-in, at rest; its truths are not kept
  std::vector<std::string> only;   // names of views; empty: all
  uint32_t rounds = 3;             // of each picture; the median time counts
  bool has_methods = false;        // draw some views by every method of shading, too
  bool has_blender = false;        // new truths instead of the kept ones
  bool is_keeping = false;         // keep the new truths
  CyclesSettings cycles;
  std::string gl_device = "auto";
  std::function<void(const std::string& doing)> on_progress;
};

/// One picture beside its truth.
struct PictureRow {
  TruthView view;
  std::string method = "tiles";
  double cpu_ms = 0.0;     // of ours
  double misplaced = 0.0;  // share of the cells where only one of both has hair
  CellError hair, skin;
  HairFigures ours, truth;
  Image shown;  // ours
  LightCells cells, truth_cells;
};

/// A picture by Cycles with few samples, beside that with many.
struct CyclesRow {
  std::string view;
  uint32_t samples = 0;
  double cpu_s = 0.0;
  CellError hair;
};

/// Hair on a head that turns evenly, at 60 pictures a second: restlessness of our pictures, and of such with
/// 16 samples a pixel, where only what truly changes is left.
struct FlickerRow {
  std::string view;
  double ours = 0.0, supersampled = 0.0;
  double ratio() const { return ours / supersampled; }
};

struct PicturesReport {
  std::vector<PictureRow> views;    // drawn as viewers draw them
  std::vector<FlickerRow> flicker;  // of a few views at rest
  std::vector<PictureRow> methods;  // of a few views
  std::vector<CyclesRow> cycles;    // where Blender ran
  std::string device_gl;            // empty: no OpenGL here, and no methods
};

/// Draws and compares. BadInput for other hair without Blender, NotFound for an unknown view or a truth that
/// is missing.
Result<PicturesReport> run_pictures(const PicturesDesc& desc);

/// Measures the flicker of a view whose strands are `strands`.
Result<FlickerRow> measure_flicker(const TruthView& view, const PosedStrands& strands, const SceneDesc& scene,
                                   Renderer& renderer);

/// Means over rows: geometric of ratios, else arithmetic.
struct PictureMeans {
  size_t rows = 0;
  double ratio = 1.0, psnr_db = 0.0, ssim = 0.0, skin_psnr_db = 0.0, cpu_ms = 0.0;
};
PictureMeans means_of(const std::vector<PictureRow>& rows,
                      const std::function<bool(const PictureRow&)>& counts);
/// Returns the processor time in which Cycles comes as near to its truth as our picture of a view is; between
/// the numbers of samples by the logarithm. NaN where it was not measured.
double cycles_s_at(const PicturesReport& report, const std::string& view, double psnr_db);

std::string pictures_text(const PicturesReport& report);
std::string pictures_csv(const PicturesReport& report);
/// Returns a self-contained page: tables, and ours beside truth and difference.
std::string pictures_page(const PicturesReport& report);

}  // namespace strandcast

// The rendering report: all methods of drawing the same strands, with time, memory and the error against a
// picture drawn at sixteen times the resolution. Near and far; runs are interleaved, so that other load on
// the machine affects all alike.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/pictures/picture_error.h"
#include "common/render/render_device.h"
#include "common/scene/scene_desc.h"
#include "common/strands/posed_strands.h"

namespace strandcast {

struct RenderingReportDesc {
  SceneDesc scene;
  RenderSize size{1280, 720};
  uint32_t rounds = 5;      // of each way; the median counts
  double far_factor = 4.0;  // distance of the far view over that of the near one
  std::string gl_device = "auto";
  std::function<void(const std::string& doing)> on_progress;
};

/// Methods that are compared with the same true picture.
struct RenderingGroup {
  std::string name;
  std::string truth;                            // in words
  RendererKind kind = RendererKind::Tiles;      // of the truth
  std::function<void(LookDesc&)> truth_change;  // of the scene's look; empty: none
  uint32_t truth_factor = 1;  // samples of the truth per pixel side, beside the renderer's own
};
const std::vector<RenderingGroup>& rendering_groups();

/// One method of drawing.
struct RenderingRow {
  std::string name;
  std::string summary;
  size_t group = 0;
  RendererKind kind = RendererKind::Tiles;
  std::function<void(LookDesc&)> change;  // of the scene's look; empty: none
};
/// Returns all rows; the first is the main path, to which times are compared.
const std::vector<RenderingRow>& rendering_rows();

struct RenderingMeasure {
  double cpu_ms = 0.0;  // of the process, median
  double wall_ms = 0.0;
  double device_ms = 0.0;  // of the renderer's passes: on a GPU its own time
  double drawn_strands = 0.0;
  double drawn_segments = 0.0;
  PictureError error;  // in the hair's pixels
  Image picture;
};

struct RenderingOutcome {
  std::string name;
  std::string summary;
  size_t group = 0;
  bool is_gl = false;
  std::string trouble;  // why it could not be drawn here; then nothing else is there
  double memory_mb = 0.0;
  RenderingMeasure near;
  RenderingMeasure far;
};

struct RenderingReport {
  std::string device_gl;  // empty: no OpenGL here
  bool has_gpu = false;   // OpenGL is hardware's
  std::string device_tiles;
  uint64_t strand_count = 0;
  std::vector<RenderingOutcome> rows;
};

/// Measures the scene's strands at rest.
Result<RenderingReport> run_rendering(const RenderingReportDesc& desc);

/// Returns the rows that take more time, near and far, and more memory than the main path; they exist for
/// comparison.
std::vector<std::string> losing_rows(const RenderingReport& report);
/// Returns the time of a GPU per 100,000 strands, to be compared with 1 ms.
double ms_per_100k_strands(const RenderingMeasure& measure);

std::string rendering_csv(const RenderingReport& report);
std::string rendering_text(const RenderingReport& report);
/// Returns a self-contained page: tables, plots of error against time and a sheet of all pictures.
std::string rendering_page(const RenderingReportDesc& desc, const RenderingReport& report);

}  // namespace strandcast

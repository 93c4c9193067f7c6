#include "server/report/rendering.h"

#include <fmt/format.h>

#include <algorithm>
#include <ctime>

#include "common/groom/groom_asset.h"
#include "common/render/tiles/tile_renderer.h"
#include "server/report/csv_file.h"
#include "server/scene/scene_content.h"

namespace strandcast {
namespace {

// The truth has so many samples per pixel side, and as many cells of light as fit.
constexpr uint32_t kTruthFactor = 4;
constexpr uint32_t kTruthCells = 128;

double process_cpu_ms() {
  timespec cpu{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &cpu);
  return 1e3 * static_cast<double>(cpu.tv_sec) + 1e-6 * static_cast<double>(cpu.tv_nsec);
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0.0 : values[values.size() / 2];
}

/// One of the two distances.
struct ReportView {
  CameraDesc camera;
  Image truth;
  PictureMask hair;
};

struct Candidate {
  const RenderingRow* row = nullptr;
  std::unique_ptr<Renderer> renderer;
  std::string trouble;
  std::vector<double> cpu_ms[2];
  std::vector<double> wall_ms[2];
};

Result<Image> drawn(Renderer& renderer, const PosedStrands& strands, const CameraDesc& camera,
                    RenderSize size) {
  RETURN_IF_ERROR(renderer.draw(strands, camera, size));
  return renderer.read_image();
}

/// Hair drawn sixteen times as finely, and where it is.
Result<ReportView> make_view_of(const RenderingReportDesc& desc, const SceneAsset& asset,
                                const CameraDesc& camera) {
  TileOptions options;
  options.light_cells = kTruthCells;
  options.is_finest = true;
  ASSIGN_OR_RETURN(const auto fine, make_tile_renderer(asset, desc.scene.look, options));
  const PosedStrands strands{{}, asset.rest_position_m};
  const RenderSize large{desc.size.width * kTruthFactor, desc.size.height * kTruthFactor};
  ASSIGN_OR_RETURN(const Image with_hair, drawn(*fine, strands, camera, large));
  SceneAsset bald = asset;
  bald.strand_count = bald.vertex_count = 0;
  bald.rest_position_m.clear();
  bald.triangle.clear();
  ASSIGN_OR_RETURN(const auto without, make_tile_renderer(bald, desc.scene.look, options));
  ASSIGN_OR_RETURN(const Image skin, drawn(*without, {}, camera, large));
  ReportView view{camera, shrunk(with_hair, kTruthFactor), {}};
  view.hair = mask_of(view.truth, shrunk(skin, kTruthFactor));
  return view;
}

}  // namespace

const std::vector<RenderingRow>& rendering_rows() {
  static const std::vector<RenderingRow> kRows = {
      {"tiles",
       "the main path: tiles on the processor, exact coverage, blended front to back, shadowed",
       RendererKind::Tiles,
       {}},
      {"tiles, 1 segment per gap", "straight between simulated vertices", RendererKind::Tiles,
       [](LookDesc& look) { look.segments = 1; }},
      {"tiles, 2 segments per gap", "", RendererKind::Tiles, [](LookDesc& look) { look.segments = 2; }},
      {"tiles, no followers", "the simulated strands alone, as thick as all", RendererKind::Tiles,
       [](LookDesc& look) { look.followers = 0; }},
      {"gl quads, hashed",
       "camera-facing quads at 2 x 2 samples, a fixed pattern of coverage, OpenGL",
       RendererKind::Gl,
       {}},
  };
  return kRows;
}

Result<RenderingReport> run_rendering(const RenderingReportDesc& desc) {
  const auto say = [&](const std::string& doing) {
    if (desc.on_progress) desc.on_progress(doing);
  };
  ASSIGN_OR_RETURN(const SceneContent content, load_scene_content(desc.scene));
  const SceneAsset asset = make_scene_asset(content.groom, content.head);
  const PosedStrands strands{{}, asset.rest_position_m};
  CameraDesc far_camera = desc.scene.camera;
  far_camera.offset_m *= static_cast<float>(desc.far_factor);
  say("drawing the truth");
  std::vector<ReportView> views;
  for (const CameraDesc& camera : {desc.scene.camera, far_camera}) {
    ASSIGN_OR_RETURN(ReportView view, make_view_of(desc, asset, camera));
    views.push_back(std::move(view));
  }
  RenderingReport report;
  ASSIGN_OR_RETURN(const auto tiles, RenderDevice::open({"tiles", "auto", {}}));
  report.device_tiles = tiles->info().name;
  auto gl = RenderDevice::open({"gl", desc.gl_device, {}});
  if (gl) report.device_gl = (*gl)->info().name;

  std::vector<Candidate> candidates;
  for (const RenderingRow& row : rendering_rows()) {
    Candidate candidate;
    candidate.row = &row;
    LookDesc look = desc.scene.look;
    if (row.change) row.change(look);
    if (row.kind == RendererKind::Gl && !gl) {
      candidate.trouble = gl.error().to_string();
    } else {
      auto made = (row.kind == RendererKind::Gl ? **gl : *tiles).make_renderer(asset, look);
      if (made)
        candidate.renderer = std::move(made).value();
      else
        candidate.trouble = made.error().to_string();
    }
    candidates.push_back(std::move(candidate));
  }
  for (Candidate& candidate : candidates) {
    RenderingOutcome outcome;
    outcome.name = candidate.row->name;
    outcome.summary = candidate.row->summary;
    report.rows.push_back(std::move(outcome));
  }
  // The first round compiles and allocates, and is looked at; the others are timed, turn by turn.
  for (uint32_t round = 0; round <= desc.rounds; ++round) {
    say(fmt::format("round {} of {}", round, desc.rounds));
    for (size_t i = 0; i < candidates.size(); ++i) {
      Candidate& candidate = candidates[i];
      RenderingOutcome& outcome = report.rows[i];
      for (size_t v = 0; v < views.size() && candidate.trouble.empty(); ++v) {
        const double cpu_begin_ms = process_cpu_ms();
        const int64_t begin_ns = now_ns();
        auto image = drawn(*candidate.renderer, strands, views[v].camera, desc.size);
        if (!image) {
          candidate.trouble = image.error().to_string();
          break;
        }
        if (round > 0) {
          candidate.cpu_ms[v].push_back(process_cpu_ms() - cpu_begin_ms);
          candidate.wall_ms[v].push_back(static_cast<double>(now_ns() - begin_ns) * 1e-6);
          continue;
        }
        RenderingMeasure& measure = v == 0 ? outcome.near : outcome.far;
        ASSIGN_OR_RETURN(measure.error, picture_error(*image, views[v].truth, views[v].hair));
        measure.drawn_segments = static_cast<double>(candidate.renderer->profile().drawn_segments);
        measure.picture = std::move(image).value();
        if (v == 0)
          report.strand_count = std::max(report.strand_count, candidate.renderer->profile().drawn_strands);
        outcome.memory_mb = std::max(
            outcome.memory_mb, static_cast<double>(candidate.renderer->passes().live_bytes()) / 1048576.0);
      }
    }
  }
  for (size_t i = 0; i < candidates.size(); ++i) {
    report.rows[i].trouble = candidates[i].trouble;
    for (size_t v = 0; v < views.size(); ++v) {
      RenderingMeasure& measure = v == 0 ? report.rows[i].near : report.rows[i].far;
      measure.cpu_ms = median(candidates[i].cpu_ms[v]);
      measure.wall_ms = median(candidates[i].wall_ms[v]);
    }
  }
  return report;
}

std::string rendering_csv(const RenderingReport& report) {
  CsvFile csv({"row", "view", "cpu_ms", "wall_ms", "cpu_over_main", "segments", "psnr_db", "ssim", "delta_e",
               "memory_mb", "trouble"});
  for (const RenderingOutcome& row : report.rows)
    for (const bool is_near : {true, false}) {
      const RenderingMeasure& measure = is_near ? row.near : row.far;
      const RenderingMeasure& main = is_near ? report.rows.front().near : report.rows.front().far;
      csv.add_row({row.name, is_near ? "near" : "far", csv_number(measure.cpu_ms),
                   csv_number(measure.wall_ms), csv_number(measure.cpu_ms / main.cpu_ms),
                   csv_number(measure.drawn_segments), csv_number(measure.error.psnr_db),
                   csv_number(measure.error.ssim), csv_number(measure.error.delta_e),
                   csv_number(row.memory_mb), row.trouble});
    }
  return csv.text();
}

std::string rendering_text(const RenderingReport& report) {
  std::string text =
      fmt::format("{:<28} {:>22} {:>22} {:>9}   (milliseconds of processor time, near | far)\n", "",
                  "near: ms  PSNR  SSIM", "far: ms  PSNR  SSIM", "MB");
  for (const RenderingOutcome& row : report.rows) {
    if (!row.trouble.empty()) {
      text += fmt::format("{:<28} not here: {}\n", row.name, row.trouble);
      continue;
    }
    text += fmt::format("{:<28} {:>8.1f} {:>6.1f} {:>6.3f} {:>8.1f} {:>6.1f} {:>6.3f} {:>9.1f}\n", row.name,
                        row.near.cpu_ms, row.near.error.psnr_db, row.near.error.ssim, row.far.cpu_ms,
                        row.far.error.psnr_db, row.far.error.ssim, row.memory_mb);
  }
  return text;
}

}  // namespace strandcast

#include "server/report/rendering.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "common/groom/groom_asset.h"
#include "common/render/tiles/tile_renderer.h"
#include "common/scene/shadow_methods.h"
#include "common/scene/strand_methods.h"
#include "server/report/process_time.h"
#include "server/report/report_files.h"
#include "server/scene/scene_content.h"

namespace strandcast {
namespace {

// The truth has so many samples per pixel side, and as many cells of light as fit.
constexpr uint32_t kTruthFactor = 4;
constexpr uint32_t kTruthCells = 128;

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
  std::vector<double> device_ms[2];
};

Result<Image> drawn(Renderer& renderer, const PosedStrands& strands, const CameraDesc& camera,
                    RenderSize size) {
  RETURN_IF_ERROR(renderer.draw(strands, camera, size));
  return renderer.read_image();
}

LookDesc changed(LookDesc look, const std::function<void(LookDesc&)>& change) {
  if (change) change(look);
  return look;
}

Result<std::unique_ptr<Renderer>> make_truth(RenderDevice& device, const RenderingGroup& group,
                                             const SceneAsset& asset, const LookDesc& look) {
  if (group.kind == RendererKind::Gl) return device.make_renderer(RendererKind::Gl, asset, look);
  TileOptions options;
  options.light_cells = kTruthCells;
  options.is_finest = true;
  return make_tile_renderer(asset, look, options);
}

/// The truth of a group from one camera, and where its hair is.
Result<ReportView> make_view_of(const RenderingReportDesc& desc, RenderDevice& device,
                                const RenderingGroup& group, const SceneAsset& asset,
                                const CameraDesc& camera) {
  const LookDesc look = changed(desc.scene.look, group.truth_change);
  const RenderSize large{desc.size.width * group.truth_factor, desc.size.height * group.truth_factor};
  SceneAsset bald = asset;
  bald.strand_count = bald.vertex_count = 0;
  bald.rest_position_m.clear();
  bald.triangle.clear();
  ASSIGN_OR_RETURN(const auto with, make_truth(device, group, asset, look));
  ASSIGN_OR_RETURN(const Image hair, drawn(*with, {{}, asset.rest_position_m}, camera, large));
  ASSIGN_OR_RETURN(const auto without, make_truth(device, group, bald, look));
  ASSIGN_OR_RETURN(const Image skin, drawn(*without, {}, camera, large));
  ReportView view{camera, shrunk(hair, group.truth_factor), {}};
  view.hair = mask_of(view.truth, shrunk(skin, group.truth_factor));
  return view;
}

/// The rows of a table of methods, from `first` on.
template <class Method>
void add_methods(const MethodTable<Method>& table, const char* kind, size_t group,
                 std::string RenderMethodsDesc::*field, std::vector<RenderingRow>& rows, size_t first = 0) {
  for (const MethodRow& row : table.rows().subspan(first)) {
    const std::string name(row.name);
    rows.push_back({fmt::format("gl {} {}", kind, name), std::string(row.summary), group, RendererKind::Gl,
                    [field, name](LookDesc& look) { look.methods.*field = name; }});
  }
}

/// Whoever names a method is drawn as quads.
void as_quads(LookDesc& look) {
  look.methods.transparency = "hashed";
}

enum GroupIndex : size_t {
  kWhole,
  kShadows,
  kTransparencies,
  kEdges,
  kShadings,
  kScatterings,
  kStrands,
  kPlaces
};

}  // namespace

const std::vector<RenderingGroup>& rendering_groups() {
  static const std::vector<RenderingGroup> kGroups = {
      {"the whole picture",
       "tiles with sixteen samples per pixel, the finest strands and light",
       RendererKind::Tiles,
       {},
       kTruthFactor},
      {"shadow", "deep shadow maps: every strand on every ray, in double", RendererKind::Gl,
       [](LookDesc& look) { look.methods.shadow = "deep_shadow"; }, 1},
      {"transparency", "quads with 64 samples per pixel", RendererKind::Gl, as_quads, kTruthFactor},
      {"edges", "quads with 64 samples per pixel", RendererKind::Gl, as_quads, kTruthFactor},
      {"shading", "the rough fibre that conserves energy, per fragment", RendererKind::Gl,
       [](LookDesc& look) {
         look.methods.shading = "chiang";
         look.methods.evaluation = "fragment";
       },
       1},
      {"scattering", "dual scattering of the rough fibre", RendererKind::Gl,
       [](LookDesc& look) {
         look.methods.shading = "chiang";
         look.methods.scattering = "dual";
       },
       1},
      {"strands", "quads of all strands and twice the segments, with 64 samples per pixel", RendererKind::Gl,
       [](LookDesc& look) {
         look.methods.detail = "full";
         look.segments *= 2;
       },
       kTruthFactor},
      {"evaluation", "the same model in every sample", RendererKind::Gl,
       [](LookDesc& look) { look.methods.evaluation = "fragment"; }, 1},
  };
  return kGroups;
}

const std::vector<RenderingRow>& rendering_rows() {
  static const std::vector<RenderingRow> kRows = [] {
    std::vector<RenderingRow> rows = {
        {"tiles",
         "the main path: exact coverage, blended front to back, shadowed, on the processor",
         kWhole,
         RendererKind::Tiles,
         {}},
        {"gl tiles", "the same by compute kernels", kWhole, RendererKind::Gl, {}},
        {"gl quads", "camera-facing quads, a pattern of samples, no style", kWhole, RendererKind::Gl,
         as_quads},
        {"tiles, 1 segment per gap", "straight between simulated vertices", kWhole, RendererKind::Tiles,
         [](LookDesc& look) { look.segments = 1; }},
        {"tiles, 2 segments per gap", "", kWhole, RendererKind::Tiles,
         [](LookDesc& look) { look.segments = 2; }},
        {"tiles, no followers", "the simulated strands alone, as thick as all", kWhole, RendererKind::Tiles,
         [](LookDesc& look) { look.followers = 0; }},
    };
    add_methods(shadow_methods(), "shadow", kShadows, &RenderMethodsDesc::shadow, rows);
    add_methods(transparency_methods(), "transparency", kTransparencies, &RenderMethodsDesc::transparency,
                rows);
    add_methods(antialiasing_methods(), "edges", kEdges, &RenderMethodsDesc::antialiasing, rows);
    add_methods(shading_models(), "shading", kShadings, &RenderMethodsDesc::shading, rows);
    add_methods(shading_places(), "evaluation", kPlaces, &RenderMethodsDesc::evaluation, rows);
    add_methods(scattering_models(), "scattering", kScatterings, &RenderMethodsDesc::scattering, rows);
    add_methods(detail_methods(), "detail", kStrands, &RenderMethodsDesc::detail, rows);
    rows.push_back({"gl detail bends, up to 8", "likewise, of more segments where hair curls", kStrands,
                    RendererKind::Gl, [](LookDesc& look) {
                      look.methods.detail = "bends";
                      look.segments = 8;
                    }});
    // The first of these is what `adaptive` draws.
    add_methods(curve_methods(), "curve", kStrands, &RenderMethodsDesc::curve, rows, 1);
    add_methods(joint_methods(), "joints", kStrands, &RenderMethodsDesc::joints, rows, 1);
    add_methods(culling_methods(), "culling", kStrands, &RenderMethodsDesc::culling, rows, 1);
    for (const char* shadow : {"deep_opacity", "density_rays"})
      rows.push_back({fmt::format("gl shadow {}, coarse casters", shadow),
                      "strands as fine as the light's map cast the shadows", kShadows, RendererKind::Gl,
                      [shadow](LookDesc& look) {
                        look.methods.shadow = shadow;
                        look.methods.shadow_detail = "coarse";
                      }});
    return rows;
  }();
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
  RenderingReport report;
  ASSIGN_OR_RETURN(const auto tiles, RenderDevice::open({"tiles", "auto", {}}));
  report.device_tiles = tiles->info().name;
  auto gl = RenderDevice::open({"gl", desc.gl_device, {}});
  if (gl) report.device_gl = (*gl)->info().name;
  report.has_gpu = gl && !(*gl)->info().is_software;
  // By group: near and far.
  std::vector<std::array<ReportView, 2>> views;
  for (const RenderingGroup& group : rendering_groups()) {
    say("drawing the truth of " + group.name);
    auto& both = views.emplace_back();
    if (group.kind == RendererKind::Gl && !gl) continue;
    RenderDevice& device = group.kind == RendererKind::Gl ? **gl : *tiles;
    ASSIGN_OR_RETURN(both[0], make_view_of(desc, device, group, asset, desc.scene.camera));
    ASSIGN_OR_RETURN(both[1], make_view_of(desc, device, group, asset, far_camera));
  }

  std::vector<Candidate> candidates;
  for (const RenderingRow& row : rendering_rows()) {
    Candidate candidate;
    candidate.row = &row;
    const LookDesc look = changed(desc.scene.look, row.change);
    if (row.kind == RendererKind::Gl && !gl) {
      candidate.trouble = gl.error().to_string();
    } else {
      RenderDevice& device = row.kind == RendererKind::Gl ? **gl : *tiles;
      auto made = device.make_renderer(row.kind, asset, look);
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
    outcome.group = candidate.row->group;
    outcome.is_gl = candidate.row->kind == RendererKind::Gl;
    report.rows.push_back(std::move(outcome));
  }
  // The first round compiles and allocates, and is looked at; the others are timed, turn by turn.
  for (uint32_t round = 0; round <= desc.rounds; ++round) {
    say(fmt::format("round {} of {}", round, desc.rounds));
    for (size_t i = 0; i < candidates.size(); ++i) {
      Candidate& candidate = candidates[i];
      RenderingOutcome& outcome = report.rows[i];
      const std::array<ReportView, 2>& seen = views[candidate.row->group];
      for (size_t v = 0; v < seen.size() && candidate.trouble.empty(); ++v) {
        const double cpu_begin_ms = process_cpu_ms();
        const int64_t begin_ns = now_ns();
        auto image = drawn(*candidate.renderer, strands, seen[v].camera, desc.size);
        if (!image) {
          candidate.trouble = image.error().to_string();
          break;
        }
        if (round > 0) {
          candidate.cpu_ms[v].push_back(process_cpu_ms() - cpu_begin_ms);
          candidate.wall_ms[v].push_back(static_cast<double>(now_ns() - begin_ns) * 1e-6);
          candidate.device_ms[v].push_back(candidate.renderer->profile().total_ms);
          continue;
        }
        RenderingMeasure& measure = v == 0 ? outcome.near : outcome.far;
        ASSIGN_OR_RETURN(measure.error, picture_error(*image, seen[v].truth, seen[v].hair));
        measure.drawn_segments = static_cast<double>(candidate.renderer->profile().drawn_segments);
        measure.drawn_strands = static_cast<double>(candidate.renderer->profile().drawn_strands);
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
    for (size_t v = 0; v < 2; ++v) {
      RenderingMeasure& measure = v == 0 ? report.rows[i].near : report.rows[i].far;
      measure.cpu_ms = median(candidates[i].cpu_ms[v]);
      measure.wall_ms = median(candidates[i].wall_ms[v]);
      measure.device_ms = median(candidates[i].device_ms[v]);
    }
  }
  return report;
}

std::vector<std::string> losing_rows(const RenderingReport& report) {
  std::vector<std::string> losing;
  const RenderingOutcome& main = report.rows.front();
  for (const RenderingOutcome& row : report.rows)
    if (row.trouble.empty() && row.near.cpu_ms > main.near.cpu_ms && row.far.cpu_ms > main.far.cpu_ms &&
        row.memory_mb > main.memory_mb)
      losing.push_back(row.name);
  return losing;
}

double ms_per_100k_strands(const RenderingMeasure& measure) {
  return measure.drawn_strands > 0.0 ? measure.device_ms * 1e5 / measure.drawn_strands : 0.0;
}

std::string rendering_csv(const RenderingReport& report) {
  CsvFile csv({"group", "row", "view", "cpu_ms", "wall_ms", "passes_ms", "cpu_over_main", "segments",
               "psnr_db", "ssim", "delta_e", "memory_mb", "trouble"});
  for (const RenderingOutcome& row : report.rows)
    for (const bool is_near : {true, false}) {
      const RenderingMeasure& measure = is_near ? row.near : row.far;
      const RenderingMeasure& main = is_near ? report.rows.front().near : report.rows.front().far;
      csv.add_row({rendering_groups()[row.group].name, row.name, is_near ? "near" : "far",
                   csv_number(measure.cpu_ms), csv_number(measure.wall_ms), csv_number(measure.device_ms),
                   csv_number(measure.cpu_ms / main.cpu_ms), csv_number(measure.drawn_segments),
                   csv_number(measure.error.psnr_db), csv_number(measure.error.ssim),
                   csv_number(measure.error.delta_e), csv_number(row.memory_mb), row.trouble});
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
  text += fmt::format("Lose to the main path in time, near and far, and in memory: {}\n",
                      fmt::join(losing_rows(report), ", "));
  if (!report.has_gpu) return text;
  text += fmt::format("\n{:<28} {:>22} {:>22}   (milliseconds of the GPU; aim: 1 per 100,000 strands)\n", "",
                      "near: ms  per 100,000", "far: ms  per 100,000");
  for (const RenderingOutcome& row : report.rows)
    if (row.trouble.empty() && row.is_gl)
      text += fmt::format("{:<28} {:>10.2f} {:>11.2f} {:>10.2f} {:>11.2f}\n", row.name, row.near.device_ms,
                          ms_per_100k_strands(row.near), row.far.device_ms, ms_per_100k_strands(row.far));
  return text;
}

}  // namespace strandcast

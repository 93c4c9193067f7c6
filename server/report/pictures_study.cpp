#include "server/report/pictures_study.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "common/base/quantile.h"
#include "common/groom/bust_skin.h"
#include "common/groom/groom_asset.h"
#include "common/render/drawn_strands.h"
#include "common/replay/state_blend.h"
#include "common/scene/scene_file.h"
#include "server/report/process_time.h"
#include "server/report/rendering.h"
#include "server/scene/scene_content.h"

namespace strandcast {
namespace {

// Views that every method draws: dark and bright hair, in front of the light and against it, and skin.
constexpr const char* kMethodViews[] = {"front_brown", "front_blond", "front_black", "front_blond_against",
                                        "side_brown"};
// Views whose flicker is measured.
constexpr const char* kFlickerViews[] = {"front_brown", "side_brown", "near_brown", "far_brown"};
// Groups of the rendering report whose rows shade in other ways.
constexpr const char* kMethodGroups[] = {"the whole picture", "shadow", "shading", "scattering",
                                         "evaluation"};
// Few samples, for the time at equal error; the seed differs from the truth's.
constexpr uint32_t kFewSamples[] = {1, 2, 4, 8, 16};
constexpr const char* kFewSamplesView = "front_brown";
constexpr uint32_t kOtherSeed = 7;

/// The hair in all poses that views need.
struct Stage {
  SceneAsset asset;
  std::map<std::string, PosedStrands> pose;
};

std::vector<TruthView> chosen_views(const PicturesDesc& desc) {
  std::vector<TruthView> views;
  for (const TruthView& view : truth_views())
    if ((!desc.scene || view.pose == "rest") &&
        (desc.only.empty() || std::count(desc.only.begin(), desc.only.end(), view.name()) > 0))
      views.push_back(view);
  return views;
}

/// The scene that a view shows; without a view the one that all share.
Result<SceneDesc> scene_of(const PicturesDesc& desc, const std::vector<std::string>& overrides) {
  return desc.scene ? with_overrides(*desc.scene, overrides) : built_in_scene_with(overrides);
}

Status check_pictures(const PicturesDesc& desc) {
  if (desc.scene && (!desc.has_blender || desc.is_keeping))
    return make_error(ErrorCode::BadInput,
                      "truths of a scene of one's own are made by --blender, and not kept");
  std::vector<std::string> known;
  for (const TruthView& view : truth_views()) known.push_back(view.name());
  for (const std::string& name : desc.only)
    if (std::count(known.begin(), known.end(), name) == 0)
      return make_error(ErrorCode::NotFound, "no view is called {} (known: {})", name,
                        fmt::join(known, ", "));
  return {};
}

Result<Stage> make_stage(const PicturesDesc& desc, const std::vector<TruthView>& views) {
  Stage stage;
  ASSIGN_OR_RETURN(const SceneDesc scene, scene_of(desc, {}));
  ASSIGN_OR_RETURN(const SceneContent content, load_scene_content(scene));
  stage.asset = make_scene_asset(content.groom, content.head);
  for (const TruthView& view : views) {
    PosedStrands& strands = stage.pose[view.pose];
    if (!strands.position_m.empty()) continue;
    if (view.pose == "rest") {
      strands.position_m = stage.asset.rest_position_m;
      continue;
    }
    if (desc.is_keeping && !std::filesystem::exists(desc.truths / (view.pose + ".strands")))
      RETURN_IF_ERROR(keep_pose(desc.truths, view.pose));
    ASSIGN_OR_RETURN(const auto state, load_pose(desc.truths, view.pose, stage.asset));
    StrandFill none;
    strands = posed_strands_of(*state, none);
    if (strands.position_m.size() != stage.asset.rest_position_m.size())
      return make_error(ErrorCode::BadInput, "the kept pose {} is of other hair than the built-in scene's",
                        view.pose);
  }
  return stage;
}

/// Turns what lies in head space as the world lies.
void turn(const glm::dquat& world_from_head, std::vector<glm::vec3>& points) {
  const glm::quat rotation(world_from_head);
  for (glm::vec3& point : points) point = rotation * point;
}

Status add_job(const PicturesDesc& desc, const Stage& stage, const TruthView& view, CyclesJob job,
               CyclesRun& run) {
  ASSIGN_OR_RETURN(const SceneDesc scene, scene_of(desc, view.overrides()));
  const PosedStrands& posed = stage.pose.at(view.pose);
  ASSIGN_OR_RETURN(DrawnHair hair, DrawnHair::make(stage.asset, scene.look));
  DrawnStrands strands = hair.strands(posed.position_m);
  turn(posed.world_from_head.rotation, strands.position_m);
  Mesh head = stage.asset.head;
  BustSkin(stage.asset.head).pose(posed.bust, head);
  turn(posed.world_from_head.rotation, head.position_m);
  job.scene = &scene;
  job.strands = &strands;
  job.head = &head;
  return run.add(job);
}

/// Draws all truths by one run of Blender, and those of few samples.
Result<std::map<std::string, CyclesPicture>> draw_truths(const PicturesDesc& desc, const Stage& stage,
                                                         const std::vector<TruthView>& views) {
  ASSIGN_OR_RETURN(CyclesRun run, CyclesRun::make(desc.scratch, desc.cycles));
  std::vector<std::string> names;
  std::map<std::string, std::string> covered_by;  // the view whose run has a cover
  for (const TruthView& view : views) {
    CyclesJob job;
    job.name = view.name();
    job.has_cover = covered_by.try_emplace(view.cover_name(), job.name).second;
    RETURN_IF_ERROR(add_job(desc, stage, view, job, run));
    names.push_back(job.name);
    if (job.name != kFewSamplesView) continue;
    for (const uint32_t samples : kFewSamples) {
      CyclesJob few;
      few.name = fmt::format("{}_{}", view.name(), samples);
      few.samples = samples;
      few.seed = kOtherSeed;
      few.has_cover = false;
      RETURN_IF_ERROR(add_job(desc, stage, view, few, run));
      names.push_back(few.name);
    }
  }
  RETURN_IF_ERROR(run.run());
  std::map<std::string, CyclesPicture> pictures;
  for (const std::string& name : names) {
    ASSIGN_OR_RETURN(pictures[name], run.picture(name));
  }
  for (const TruthView& view : views)
    pictures[view.name()].truth.cover = pictures[covered_by[view.cover_name()]].truth.cover;
  return pictures;
}

/// Share of hair's cells that only the truth, or only ours, covers whole; `hair` counts ours' pixels.
double misplaced_share(const PictureMask& hair, uint32_t width, const CoverCells& cover) {
  constexpr float kWhole = 0.9f;
  constexpr float kNone = 0.02f;
  size_t off = 0;
  size_t all = 0;
  for (size_t i = 0; i < cover.hair.size(); ++i) {
    uint32_t pixels = 0;
    for (uint32_t k = 0; k < kCellPx * kCellPx; ++k)
      pixels += hair[((i / cover.width) * kCellPx + k / kCellPx) * width + (i % cover.width) * kCellPx +
                     k % kCellPx];
    if (cover.hair[i] > kWhole && pixels <= 1) ++off;
    if (cover.hair[i] < kNone && pixels == kCellPx * kCellPx) ++off;
    if (cover.hair[i] > 0.5f) ++all;
  }
  return all > 0 ? static_cast<double>(off) / static_cast<double>(all) : 1.0;
}

Result<PictureRow> measure_picture(const PicturesDesc& desc, const Stage& stage, const TruthView& view,
                                   const ViewTruth& truth, const std::function<void(LookDesc&)>& change,
                                   Renderer& renderer) {
  ASSIGN_OR_RETURN(SceneDesc scene, scene_of(desc, view.overrides()));
  if (change) change(scene.look);
  RETURN_IF_ERROR(renderer.set_look(scene.look));
  const RenderSize size{truth.light.width * kCellPx, truth.light.height * kCellPx};
  const PosedStrands& strands = stage.pose.at(view.pose);
  PictureRow row;
  row.view = view;
  DrawTerms marked;
  marked.debug_view = DebugView::Tangents;
  RETURN_IF_ERROR(renderer.draw(strands, scene.camera, size, marked));
  const Image tangents = renderer.read_image();
  std::vector<double> cpu_ms;
  for (uint32_t round = 0; round < desc.rounds; ++round) {
    const double begin_ms = process_cpu_ms();
    RETURN_IF_ERROR(renderer.draw(strands, scene.camera, size));
    row.shown = renderer.read_image();
    cpu_ms.push_back(process_cpu_ms() - begin_ms);
  }
  row.cpu_ms = median(cpu_ms);
  row.misplaced = misplaced_share(mask_of(row.shown, tangents), size.width, truth.cover);
  row.cells = cells_of(row.shown);
  row.truth_cells = over_background(truth.light, truth.cover, scene.look.background);
  ASSIGN_OR_RETURN(row.hair, cell_error(row.cells, row.truth_cells, truth.cover, CellPart::Hair));
  ASSIGN_OR_RETURN(row.skin, cell_error(row.cells, row.truth_cells, truth.cover, CellPart::Skin));
  ASSIGN_OR_RETURN(row.ours, hair_figures(row.cells, truth.cover));
  ASSIGN_OR_RETURN(row.truth, hair_figures(row.truth_cells, truth.cover));
  return row;
}

/// Draws by every row of the rendering report that shades in another way; what does not draw here is left
/// out.
Status measure_methods(const PicturesDesc& desc, const Stage& stage,
                       const std::map<std::string, ViewTruth>& truths, PicturesReport& report) {
  auto gl = RenderDevice::open({"gl", desc.gl_device, {}});
  if (gl) report.device_gl = (*gl)->info().name;
  ASSIGN_OR_RETURN(const auto tiles, RenderDevice::open({"tiles", "auto", {}}));
  ASSIGN_OR_RETURN(const SceneDesc scene, scene_of(desc, {}));
  for (const RenderingRow& method : rendering_rows()) {
    const std::string& group = rendering_groups()[method.group].name;
    if (std::find(std::begin(kMethodGroups), std::end(kMethodGroups), group) == std::end(kMethodGroups))
      continue;
    if (method.kind == RendererKind::Gl && !gl) continue;
    if (desc.on_progress) desc.on_progress(method.name);
    LookDesc look = scene.look;
    if (method.change) method.change(look);
    RenderDevice& device = method.kind == RendererKind::Gl ? **gl : *tiles;
    auto renderer = device.make_renderer(method.kind, stage.asset, look);
    if (!renderer) continue;
    for (const TruthView& view : truth_views()) {
      const auto truth = truths.find(view.name());
      const bool is_wanted =
          std::find(std::begin(kMethodViews), std::end(kMethodViews), view.name()) != std::end(kMethodViews);
      if (!is_wanted || truth == truths.end()) continue;
      auto row = measure_picture(desc, stage, view, truth->second, method.change, **renderer);
      if (!row) return at(method.name, row.error());
      row->method = method.name;
      report.methods.push_back(std::move(row).value());
    }
  }
  return {};
}

}  // namespace

Result<PicturesReport> run_pictures(const PicturesDesc& desc) {
  const auto say = [&](const std::string& doing) {
    if (desc.on_progress) desc.on_progress(doing);
  };
  RETURN_IF_ERROR(check_pictures(desc));
  const std::vector<TruthView> views = chosen_views(desc);
  ASSIGN_OR_RETURN(const Stage stage, make_stage(desc, views));
  std::map<std::string, ViewTruth> truths;
  PicturesReport report;
  if (desc.has_blender) {
    say(fmt::format("Cycles draws {} views", views.size()));
    ASSIGN_OR_RETURN(const auto drawn, draw_truths(desc, stage, views));
    for (const TruthView& view : views) {
      truths[view.name()] = drawn.at(view.name()).truth;
      if (desc.is_keeping) RETURN_IF_ERROR(keep_truth(desc.truths, view, truths[view.name()]));
      for (const uint32_t samples : kFewSamples) {
        const auto few = drawn.find(fmt::format("{}_{}", view.name(), samples));
        if (few == drawn.end()) continue;
        CyclesRow row{view.name(), samples, few->second.cpu_s, {}};
        ASSIGN_OR_RETURN(row.hair, cell_error(few->second.truth.light, truths[view.name()].light,
                                              truths[view.name()].cover, CellPart::Hair));
        report.cycles.push_back(row);
      }
    }
  } else {
    for (const TruthView& view : views) {
      ASSIGN_OR_RETURN(truths[view.name()], load_truth(desc.truths, view));
    }
  }
  ASSIGN_OR_RETURN(const SceneDesc scene, scene_of(desc, {}));
  ASSIGN_OR_RETURN(const auto tiles, RenderDevice::open({"tiles", "auto", {}}));
  ASSIGN_OR_RETURN(const auto renderer, tiles->make_renderer(RendererKind::Tiles, stage.asset, scene.look));
  for (const TruthView& view : views) {
    say(view.name());
    ASSIGN_OR_RETURN(PictureRow row,
                     measure_picture(desc, stage, view, truths.at(view.name()), {}, *renderer));
    report.views.push_back(std::move(row));
    if (std::find(std::begin(kFlickerViews), std::end(kFlickerViews), view.name()) == std::end(kFlickerViews))
      continue;
    say(fmt::format("{}: flicker", view.name()));
    ASSIGN_OR_RETURN(const SceneDesc seen, scene_of(desc, view.overrides()));
    ASSIGN_OR_RETURN(FlickerRow flicker, measure_flicker(view, stage.pose.at(view.pose), seen, *renderer));
    report.flicker.push_back(std::move(flicker));
  }
  if (desc.has_methods) RETURN_IF_ERROR(measure_methods(desc, stage, truths, report));
  return report;
}

PictureMeans means_of(const std::vector<PictureRow>& rows,
                      const std::function<bool(const PictureRow&)>& counts) {
  PictureMeans means;
  double log_ratio = 0.0;
  size_t with_skin = 0;
  for (const PictureRow& row : rows) {
    if (!counts(row)) continue;
    ++means.rows;
    log_ratio += std::log(row.hair.luminance_ratio);
    means.psnr_db += row.hair.psnr_db;
    means.ssim += row.hair.ssim;
    means.cpu_ms += row.cpu_ms;
    if (row.skin.cells == 0) continue;
    ++with_skin;
    means.skin_psnr_db += row.skin.psnr_db;
  }
  if (means.rows == 0) return means;
  const auto count = static_cast<double>(means.rows);
  means.ratio = std::exp(log_ratio / count);
  means.psnr_db /= count;
  means.ssim /= count;
  means.cpu_ms /= count;
  means.skin_psnr_db /= static_cast<double>(std::max<size_t>(with_skin, 1));
  return means;
}

double cycles_s_at(const PicturesReport& report, const std::string& view, double psnr_db) {
  const CyclesRow* before = nullptr;
  for (const CyclesRow& row : report.cycles) {
    if (row.view != view) continue;
    if (row.hair.psnr_db >= psnr_db) {
      if (before == nullptr) return row.cpu_s;  // its coarsest is better already
      const double share = (psnr_db - before->hair.psnr_db) / (row.hair.psnr_db - before->hair.psnr_db);
      return before->cpu_s * std::pow(row.cpu_s / before->cpu_s, share);
    }
    before = &row;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace strandcast

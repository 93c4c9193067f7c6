#include "server/report/pruning.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/quantile.h"
#include "common/base/units.h"
#include "common/groom/groom_asset.h"
#include "common/render/render_device.h"
#include "server/app/explain.h"
#include "server/report/html_page.h"
#include "server/report/report_files.h"
#include "server/report/scene_run.h"
#include "server/report/svg_bars.h"
#include "server/sim/followed_solver.h"
#include "server/sim/solver_registry.h"

namespace strandcast {
namespace {

/// Facts that bring a pass of the step, with its name in the list.
struct FactPass {
  const char* fact;
  const char* pass;
};
constexpr std::array kFactPasses{
    FactPass{"has_wind", "scene/wind"},
    FactPass{"has_turbulence", "scene/gusts"},
    FactPass{"has_colliders", "scene/colliders"},
    FactPass{"has_follicle_limit", "scene/follicle_limit"},
    FactPass{"has_bend_limit", "scene/bend_limit"},
    FactPass{"has_volume", "sim/volume"},
    FactPass{"has_distance_field", "scene/distance_field"},
};
constexpr RenderSize kPictureSize{320, 240};
constexpr double kKilobyte = 1e3;

/// The motion from its first pose on, upright there.
Pose head_at(const StreamMotion& motion, double time_s) {
  const Pose first = motion.head_at(0.0), now = motion.head_at(time_s);
  const glm::dquat upright = glm::conjugate(first.rotation);
  return {upright * (now.position_m - first.position_m), upright * now.rotation};
}

Pose head_at(const PruningDesc& desc, int step) {
  return head_at(desc.motion, step / desc.scene.step_rate_hz);
}

Result<Image> draw(const PruningDesc& desc, const SceneContent& content, const Snapshot& snapshot) {
  const SceneAsset asset = make_scene_asset(content.groom, content.head);
  ASSIGN_OR_RETURN(const auto device, RenderDevice::open({"tiles", "auto", {}}));
  ASSIGN_OR_RETURN(const auto renderer, device->make_renderer(asset, desc.scene.look));
  RETURN_IF_ERROR(renderer->draw({snapshot.world_from_head, positions_in_head(snapshot)}, desc.scene.camera,
                                 kPictureSize));
  return renderer->read_image();
}

double largest_distance_mm(const Snapshot& a, const Snapshot& b) {
  const std::vector<glm::vec3> from = positions_in_head(a), to = positions_in_head(b);
  double largest_m = 0.0;
  for (size_t i = 0; i < from.size(); ++i)
    largest_m = std::max(largest_m, double{glm::distance(from[i], to[i])});
  return kMmPerM * largest_m;
}

std::string hair_text(const PrunedPass& pass) {
  return pass.is_same_hair ? "same" : fmt::format("{:.4f} mm", pass.largest_mm);
}

/// Both ways in turns, each first in every other step.
Status run_both(const PruningDesc& desc, const SceneContent& content, const char* fact, Executor& executor,
                PrunedPass& pass) {
  ASSIGN_OR_RETURN(const auto without, SceneRun::make(desc.scene, content, {}, executor));
  ASSIGN_OR_RETURN(const auto with, SceneRun::make(desc.scene, content, {.forced = {fact}}, executor));
  pass.is_same_hair = true;
  std::shared_ptr<const Snapshot> last_without, last_with;
  for (int step = 1; step <= desc.steps; ++step) {
    const Pose head = head_at(desc, step);
    RETURN_IF_ERROR((step % 2 == 0 ? *without : *with).step(head));
    RETURN_IF_ERROR((step % 2 == 0 ? *with : *without).step(head));
    ASSIGN_OR_RETURN(last_without, without->publish());
    ASSIGN_OR_RETURN(last_with, with->publish());
    if (state_hash(*last_without) == state_hash(*last_with)) continue;
    pass.is_same_hair = false;
    pass.largest_mm = std::max(pass.largest_mm, largest_distance_mm(*last_without, *last_with));
  }
  pass.without_ms = without->step_median_ms();
  pass.with_ms = with->step_median_ms();
  pass.without_bytes = without->step_bytes();
  pass.with_bytes = with->step_bytes();
  if (!desc.has_pictures) return {};
  ASSIGN_OR_RETURN(const Image image_without, draw(desc, content, *last_without));
  ASSIGN_OR_RETURN(const Image image_with, draw(desc, content, *last_with));
  pass.has_pictures = true;
  pass.is_same_picture = image_without.rgba == image_with.rgba;
  return {};
}

/// Hair is the same whether or not its states were read.
Result<bool> is_same_unread(const PruningDesc& desc, const SceneContent& content, Executor& executor) {
  ASSIGN_OR_RETURN(const auto unread, SceneRun::make(desc.scene, content, {}, executor));
  ASSIGN_OR_RETURN(const auto read, SceneRun::make(desc.scene, content, {}, executor));
  std::shared_ptr<const Snapshot> state;
  for (int step = 1; step <= desc.steps; ++step) {
    RETURN_IF_ERROR(unread->step(head_at(desc, step)));
    RETURN_IF_ERROR(read->step(head_at(desc, step)));
    ASSIGN_OR_RETURN(state, read->publish());
    ASSIGN_OR_RETURN(const size_t bytes, read->encoded_bytes(*state));
    static_cast<void>(bytes);
  }
  ASSIGN_OR_RETURN(const auto last, unread->publish());
  return state_hash(*last) == state_hash(*state);
}

/// What readers of strands and pictures make run.
Status measure_readers(const PruningDesc& desc, const SceneContent& content, PruningRun& run) {
  ASSIGN_OR_RETURN(const Measured read,
                   measure_passes(desc.scene, content, {.strand_viewers = 1, .frame_viewers = 1},
                                  MeasureConfig{"lanes", "auto", "tiles", {}}));
  for (const gl::PassReport& pass : read.passes) {
    const bool is_reader_pass = pass.name.starts_with("publish/") || pass.name.starts_with("encode/") ||
                                pass.name.starts_with("render/");
    if (is_reader_pass && pass.fate == gl::PassFate::Kept)
      run.reader_passes.push_back({pass.name, pass.median_ms, pass.size_bytes});
  }
  return {};
}

std::string kilobytes(double bytes) {
  return fmt::format("{:.1f}", bytes / kKilobyte);
}

std::string yes_or_no(bool value) {
  return value ? "yes" : "NO";
}

double saved_bytes(const PrunedPass& pass) {
  return static_cast<double>(pass.with_bytes) - static_cast<double>(pass.without_bytes);
}

double reader_ms(const PruningRun& run) {
  double sum = 0.0;
  for (const ReaderPass& pass : run.reader_passes) sum += pass.ms;
  return sum;
}

uint64_t reader_bytes(const PruningRun& run) {
  uint64_t sum = 0;
  for (const ReaderPass& pass : run.reader_passes) sum += pass.bytes;
  return sum;
}

const char* vertices_text(const FollowedDesc& part) {
  return part.has_every_vertex ? "all" : "half";
}

}  // namespace

Result<PruningRun> run_pruning(const PruningDesc& desc, Executor& executor) {
  PruningRun run;
  run.scene = desc.scene.name;
  ASSIGN_OR_RETURN(const SceneContent content, load_scene_content(desc.scene));
  ASSIGN_OR_RETURN(const SolverRow* row, find_solver(desc.scene.solver.name));
  for (const FeatureReason& reason : explain(desc.scene, {})) {
    const auto found = std::find_if(kFactPasses.begin(), kFactPasses.end(),
                                    [&](const FactPass& candidate) { return candidate.fact == reason.name; });
    if (found == kFactPasses.end() || reason.value) continue;
    PrunedPass pass;
    pass.pass = found->pass;
    pass.reason = reason.reason;
    const bool is_of_kernels =
        std::string_view(found->fact) == "has_bend_limit" || std::string_view(found->fact) == "has_volume";
    if (std::string_view(found->fact) == "has_distance_field")
      pass.note = "another collider: there is no field to load";
    else if (!row->has_kernel && is_of_kernels)
      pass.note = "the strand model has no kernel";
    else
      RETURN_IF_ERROR(run_both(desc, content, found->fact, executor, pass));
    run.passes.push_back(std::move(pass));
  }
  ASSIGN_OR_RETURN(run.is_same_unread, is_same_unread(desc, content, executor));
  if (desc.has_pictures) RETURN_IF_ERROR(measure_readers(desc, content, run));
  return run;
}

Result<FollowedRun> run_followed(const PruningDesc& desc, const FollowedDesc& part, Executor& executor) {
  FollowedRun run;
  run.scene = desc.scene.name;
  run.part = part;
  PruningDesc whole = desc;
  if (!part.has_volume) whole.scene.volume = {};
  SceneDesc followed = whole.scene;
  RuntimeFacts facts;
  if (part.has_every_vertex) {
    followed.detail.simulated_share = part.share;
  } else {
    followed.detail.far_share = part.share;
    facts = {.detail = DetailLevel::FewerVertices, .detail_reason = "asked for"};
  }
  ASSIGN_OR_RETURN(const SceneContent content, load_scene_content(whole.scene));
  ASSIGN_OR_RETURN(const auto all, SceneRun::make(whole.scene, content, {}, executor));
  ASSIGN_OR_RETURN(const auto some, SceneRun::make(followed, content, facts, executor));
  const uint32_t strands = content.groom.strand_count();
  run.simulated = guide_count(strands, part.share);
  const VertexFollow vertices(content.groom, part.has_every_vertex ? 1 : kFarVertexStride);
  std::vector<double> errors_mm;
  double squares = 0.0, all_bytes = 0.0, some_bytes = 0.0;
  for (int step = 1; step <= desc.steps; ++step) {
    const Pose head = head_at(whole, step);
    RETURN_IF_ERROR((step % 2 == 0 ? *all : *some).step(head));
    RETURN_IF_ERROR((step % 2 == 0 ? *some : *all).step(head));
    ASSIGN_OR_RETURN(const auto truth, all->publish());
    ASSIGN_OR_RETURN(const auto guess, some->publish());
    ASSIGN_OR_RETURN(const size_t truth_bytes, all->encoded_bytes(*truth));
    ASSIGN_OR_RETURN(const size_t guess_bytes, some->encoded_bytes(*guess));
    if (step > 1) {
      all_bytes += static_cast<double>(truth_bytes);
      some_bytes += static_cast<double>(guess_bytes);
    }
    // After the first second: hair has begun to move.
    if (step * 3 < desc.steps || step % 10 != 0) continue;
    const std::vector<glm::vec3> a = positions_in_head(*truth), b = positions_in_head(*guess);
    for (size_t i = 0; i < a.size(); ++i) {
      const bool is_kept = std::ranges::binary_search(vertices.kept(), static_cast<uint32_t>(i / strands));
      if (i % strands < run.simulated && is_kept) continue;
      const double error_mm = kMmPerM * glm::distance(glm::dvec3(a[i]), glm::dvec3(b[i]));
      errors_mm.push_back(error_mm);
      squares += error_mm * error_mm;
    }
  }
  const double per_s = desc.scene.step_rate_hz * kMbitPerByte / std::max(1, desc.steps - 1);
  run.all_mbit_per_s = all_bytes * per_s;
  run.mbit_per_s = some_bytes * per_s;
  run.all_step_ms = all->step_median_ms();
  run.step_ms = some->step_median_ms();
  for (const gl::PassReport& pass : some->passes())
    if (pass.name == "publish/follow") run.follow_ms = pass.median_ms;
  run.all_bytes = all->solver_bytes();
  run.bytes = some->solver_bytes();
  if (!errors_mm.empty()) {
    run.rms_mm = std::sqrt(squares / static_cast<double>(errors_mm.size()));
    run.p95_mm = quantile(std::move(errors_mm), 0.95);
  }
  return run;
}

std::vector<std::string> pruning_breaks(const std::vector<PruningRun>& runs) {
  std::vector<std::string> breaks;
  for (const PruningRun& run : runs) {
    for (const PrunedPass& pass : run.passes) {
      if (!pass.note.empty()) continue;
      if (pass.largest_mm > kRoundingMm)
        breaks.push_back(fmt::format("{}: hair is up to {:.3f} mm elsewhere with {} than without it",
                                     run.scene, pass.largest_mm, pass.pass));
      if (pass.is_same_hair && pass.has_pictures && !pass.is_same_picture)
        breaks.push_back(
            fmt::format("{}: the picture is another with {} than without it", run.scene, pass.pass));
    }
    if (!run.is_same_unread)
      breaks.push_back(fmt::format("{}: hair is elsewhere where nobody read its states", run.scene));
  }
  return breaks;
}

std::string pruning_text(const std::vector<PruningRun>& runs, const std::vector<FollowedRun>& followed) {
  std::string text =
      fmt::format("{:<19} {:<21} {:>9} {:>9} {:>9} {:>9}  {:<9} {:<7} {}\n", "scene", "left out", "ms",
                  "ms with", "saved ms", "saved kB", "hair", "picture", "because");
  for (const PruningRun& run : runs) {
    for (const PrunedPass& pass : run.passes) {
      if (!pass.note.empty()) {
        text += fmt::format("{:<19} {:<21} {:>9} {:>9} {:>9} {:>9}  {:<9} {:<7} {}; {}\n", run.scene,
                            pass.pass, "-", "-", "-", "-", "-", "-", pass.reason, pass.note);
        continue;
      }
      text += fmt::format("{:<19} {:<21} {:>9.3f} {:>9.3f} {:>9.3f} {:>9}  {:<9} {:<7} {}\n", run.scene,
                          pass.pass, pass.without_ms, pass.with_ms, pass.with_ms - pass.without_ms,
                          kilobytes(saved_bytes(pass)), hair_text(pass),
                          !pass.has_pictures ? "-" : (pass.is_same_picture ? "same" : "OTHER"), pass.reason);
    }
    text += fmt::format("{:<19} {:<21} {:>9} {:>9} {:>9.3f} {:>9}  {:<9} {:<7} nobody reads: per state\n",
                        run.scene, "all that readers want", "-", "-", reader_ms(run),
                        kilobytes(static_cast<double>(reader_bytes(run))),
                        run.is_same_unread ? "same" : "MOVED", "-");
  }
  if (followed.empty()) return text;
  text += "\nMost of the hair follows a part of it\n";
  text += fmt::format("{:<10} {:<7} {:>6} {:>8} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>8} {:>8}\n", "scene",
                      "volume", "share", "vertices", "all ms", "ms", "follow ms", "all Mb/s", "Mb/s",
                      "saved kB", "rms mm", "p95 mm");
  for (const FollowedRun& run : followed)
    text += fmt::format(
        "{:<10} {:<7} {:>6.3f} {:>8} {:>9.3f} {:>9.3f} {:>9.3f} {:>9.2f} {:>9.2f} {:>9} {:>8.2f} {:>8.2f}\n",
        run.scene, run.part.has_volume ? "on" : "off", run.part.share, vertices_text(run.part),
        run.all_step_ms, run.step_ms, run.follow_ms, run.all_mbit_per_s, run.mbit_per_s,
        kilobytes(static_cast<double>(run.all_bytes) - static_cast<double>(run.bytes)), run.rms_mm,
        run.p95_mm);
  return text;
}

std::string pruning_csv(const std::vector<PruningRun>& runs) {
  CsvFile csv({"scene", "pass", "reason", "step_ms", "step_ms_with", "saved_ms", "saved_bytes", "same_hair",
               "largest_mm", "same_picture", "note"});
  for (const PruningRun& run : runs) {
    for (const PrunedPass& pass : run.passes) {
      if (!pass.note.empty())
        csv.add_row({run.scene, pass.pass, pass.reason, "", "", "", "", "", "", "", pass.note});
      else
        csv.add_row({run.scene, pass.pass, pass.reason, csv_number(pass.without_ms), csv_number(pass.with_ms),
                     csv_number(pass.with_ms - pass.without_ms), csv_number(saved_bytes(pass)),
                     yes_or_no(pass.is_same_hair), csv_number(pass.largest_mm),
                     pass.has_pictures ? yes_or_no(pass.is_same_picture) : "", ""});
    }
    for (const ReaderPass& pass : run.reader_passes)
      csv.add_row({run.scene, pass.pass, "nobody reads", "", "", csv_number(pass.ms),
                   csv_number(static_cast<double>(pass.bytes)), yes_or_no(run.is_same_unread), "", "", ""});
  }
  return csv.text();
}

std::string followed_csv(const std::vector<FollowedRun>& followed) {
  CsvFile csv({"scene", "volume", "share", "vertices", "simulated", "all_step_ms", "step_ms", "follow_ms",
               "all_solver_bytes", "solver_bytes", "all_mbit_per_s", "mbit_per_s", "rms_mm", "p95_mm"});
  for (const FollowedRun& run : followed)
    csv.add_row({run.scene, yes_or_no(run.part.has_volume), csv_number(run.part.share),
                 vertices_text(run.part), csv_number(run.simulated), csv_number(run.all_step_ms),
                 csv_number(run.step_ms), csv_number(run.follow_ms),
                 csv_number(static_cast<double>(run.all_bytes)), csv_number(static_cast<double>(run.bytes)),
                 csv_number(run.all_mbit_per_s), csv_number(run.mbit_per_s), csv_number(run.rms_mm),
                 csv_number(run.p95_mm)});
  return csv.text();
}

std::string pruning_page(const std::vector<PruningRun>& runs, const std::vector<FollowedRun>& followed) {
  HtmlPage page("What is left out, and what it saves");
  const std::vector<std::string> breaks = pruning_breaks(runs);
  page.answer(breaks.empty() ? "Hair and pictures are the same, byte for byte, with and without every pass."
                             : "Some passes change what is seen though nobody asked for them.");
  for (const std::string& sentence : breaks) page.paragraph(sentence);
  BarDesc bars;
  bars.title = "A step of each scene, as it is and with each pass that it is without";
  bars.y_title = "saved ms a step";
  BarSeries series{"with the pass, less without", {}, 0};
  HtmlTable table{"Median of a whole step, both ways in turns",
                  {"scene", "left out", "ms", "ms with", "saved kB", "hair", "picture", "because"},
                  {}};
  for (const PruningRun& run : runs) {
    for (const PrunedPass& pass : run.passes) {
      if (!pass.note.empty()) continue;
      bars.groups.push_back(run.scene + " " + pass.pass);
      series.value.push_back(std::max(0.0, pass.with_ms - pass.without_ms));
      table.rows.push_back(
          {run.scene, pass.pass, fmt::format("{:.3f}", pass.without_ms), fmt::format("{:.3f}", pass.with_ms),
           kilobytes(saved_bytes(pass)),
           HtmlCell(hair_text(pass), pass.largest_mm <= kRoundingMm ? HtmlMark::Good : HtmlMark::Bad),
           pass.has_pictures ? (pass.is_same_picture ? "same" : "other") : "", pass.reason});
    }
  }
  bars.series.push_back(std::move(series));
  constexpr double kBarPx = 22.0;
  bars.width = std::max(bars.width, kBarPx * static_cast<double>(bars.groups.size()));
  page.figure(make_svg_bars(bars),
              "Forced by the one place that decides, so that everything else is as it runs.");
  page.table(table);
  HtmlTable readers{"What runs only while somebody reads, for a state", {"scene", "pass", "ms", "kB"}, {}};
  for (const PruningRun& run : runs)
    for (const ReaderPass& pass : run.reader_passes)
      readers.rows.push_back(
          {run.scene, pass.pass, fmt::format("{:.3f}", pass.ms), kilobytes(static_cast<double>(pass.bytes))});
  page.table(readers);
  HtmlTable guides{"Hair that follows a part of it, against all simulated",
                   {"scene", "volume", "share", "vertices", "all ms", "ms", "follow ms", "all Mbit/s",
                    "Mbit/s", "rms mm", "p95 mm"},
                   {}};
  for (const FollowedRun& run : followed)
    guides.rows.push_back({run.scene, run.part.has_volume ? "on" : "off",
                           fmt::format("{:.3f}", run.part.share), vertices_text(run.part),
                           fmt::format("{:.3f}", run.all_step_ms), fmt::format("{:.3f}", run.step_ms),
                           fmt::format("{:.3f}", run.follow_ms), fmt::format("{:.2f}", run.all_mbit_per_s),
                           fmt::format("{:.2f}", run.mbit_per_s), fmt::format("{:.2f}", run.rms_mm),
                           fmt::format("{:.2f}", run.p95_mm)});
  page.table(guides);
  return page.text();
}

}  // namespace strandcast

// The page of the rendering report.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "common/plot/svg_plot.h"
#include "server/report/html_page.h"
#include "server/report/rendering.h"

namespace strandcast {
namespace {

constexpr int kSheetQuality = 88;

/// Error against time, a point a row.
std::string plot_of(const RenderingReport& report, size_t group, bool is_near) {
  PlotDesc plot;
  plot.title = is_near ? "Near" : "Far";
  plot.x.title = "processor time of a picture, ms";
  plot.y.title = "difference to the truth, dE (1 is just seen)";
  for (const RenderingOutcome& row : report.rows) {
    if (!row.trouble.empty() || row.group != group) continue;
    const RenderingMeasure& measure = is_near ? row.near : row.far;
    plot.series.push_back({.name = row.name,
                           .points = {{measure.cpu_ms, measure.error.delta_e,
                                       fmt::format("{}: {:.1f} dB", row.name, measure.error.psnr_db)}},
                           .mark = PlotMark::Dots});
  }
  return make_svg_plot(plot);
}

HtmlTable table_of(const RenderingReport& report, size_t group, bool is_near) {
  HtmlTable table;
  table.caption = is_near ? "Near" : "Far";
  table.columns = {"row", "CPU ms", "over the main path", "wall ms", "segments", "PSNR dB", "SSIM",
                   "dE",  "MB"};
  const RenderingMeasure& main = is_near ? report.rows.front().near : report.rows.front().far;
  for (const RenderingOutcome& row : report.rows) {
    if (row.group != group) continue;
    if (!row.trouble.empty()) {
      table.rows.push_back({row.name, row.trouble, "", "", "", "", "", "", ""});
      continue;
    }
    const RenderingMeasure& m = is_near ? row.near : row.far;
    const bool loses = m.cpu_ms > main.cpu_ms;
    table.rows.push_back(
        {row.name, fmt::format("{:.1f}", m.cpu_ms),
         HtmlCell(fmt::format("{:.2f}", m.cpu_ms / main.cpu_ms), loses ? HtmlMark::Bad : HtmlMark::None),
         fmt::format("{:.1f}", m.wall_ms), fmt::format("{:.0f}", m.drawn_segments),
         fmt::format("{:.1f}", m.error.psnr_db), fmt::format("{:.4f}", m.error.ssim),
         fmt::format("{:.2f}", m.error.delta_e), fmt::format("{:.1f}", row.memory_mb)});
  }
  return table;
}

HtmlTable gpu_table(const RenderingReport& report) {
  HtmlTable table;
  table.caption = report.device_gl;
  table.columns = {"row", "near: ms", "per 100,000 strands", "far: ms", "per 100,000 strands"};
  for (const RenderingOutcome& row : report.rows) {
    if (!row.trouble.empty() || !row.is_gl) continue;
    table.rows.push_back({row.name, fmt::format("{:.2f}", row.near.device_ms),
                          fmt::format("{:.2f}", ms_per_100k_strands(row.near)),
                          fmt::format("{:.2f}", row.far.device_ms),
                          fmt::format("{:.2f}", ms_per_100k_strands(row.far))});
  }
  return table;
}

}  // namespace

std::string rendering_page(const RenderingReportDesc& desc, const RenderingReport& report) {
  HtmlPage page("Rendering: error against time");
  page.paragraph(fmt::format(
      "Scene {}: {} strands at rest, {} x {} pixels. Processor: {}. OpenGL: {}. Every row drew the same "
      "strands, turn by "
      "turn; the median of {} turns counts. Errors are those of the hair's pixels, against the truth of each "
      "group. Far is {:g} times as far away.",
      desc.scene.name, report.strand_count, desc.size.width, desc.size.height, report.device_tiles,
      report.device_gl.empty() ? "none" : report.device_gl, desc.rounds, desc.far_factor));
  std::string slower;
  for (const RenderingOutcome& row : report.rows) {
    const RenderingOutcome& main = report.rows.front();
    if (row.trouble.empty() && row.near.cpu_ms > main.near.cpu_ms && row.far.cpu_ms > main.far.cpu_ms)
      slower += (slower.empty() ? "" : ", ") + row.name;
  }
  page.answer(slower.empty() ? "No row is slower than the main path both near and far."
                             : "Slower than the main path, which draws everything at once, near and far: " +
                                   slower + ".");
  const std::vector<std::string> losing = losing_rows(report);
  page.paragraph(losing.empty()
                     ? "No row loses to it in memory as well."
                     : fmt::format("Those that also take more memory lose to it everywhere, and stay "
                                   "to be compared with: {}.",
                                   fmt::join(losing, ", ")));
  if (report.has_gpu) {
    page.heading("GPU");
    page.paragraph(
        "Milliseconds of the GPU for all passes of a picture, to be held against 1 ms per 100,000 strands.");
    page.table(gpu_table(report));
  }
  for (size_t group = 0; group < rendering_groups().size(); ++group) {
    const RenderingGroup& held = rendering_groups()[group];
    page.heading(held.name);
    page.paragraph("Held against: " + held.truth + ".");
    for (const bool is_near : {true, false}) {
      page.table(table_of(report, group, is_near));
      page.figure(plot_of(report, group, is_near), "Down and to the left is better.");
    }
  }
  page.heading("All pictures");
  for (const RenderingOutcome& row : report.rows) {
    if (!row.trouble.empty()) continue;
    if (const auto jpeg = encode_jpeg(row.near.picture, kSheetQuality))
      page.picture(*jpeg, row.summary.empty() ? row.name : row.name + ": " + row.summary);
  }
  return page.text();
}

}  // namespace strandcast

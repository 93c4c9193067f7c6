// The page of the rendering report.
#include <fmt/format.h>

#include "server/report/html_page.h"
#include "server/report/rendering.h"
#include "server/report/svg_plot.h"

namespace strandcast {
namespace {

constexpr int kSheetQuality = 88;

/// Error against time, a point a row.
std::string plot_of(const RenderingReport& report, bool is_near) {
  PlotDesc plot;
  plot.title = is_near ? "Near" : "Far";
  plot.x.title = "processor time of a picture, ms";
  plot.y.title = "difference to the truth, dE (1 is just seen)";
  for (const RenderingOutcome& row : report.rows) {
    if (!row.trouble.empty()) continue;
    const RenderingMeasure& measure = is_near ? row.near : row.far;
    plot.series.push_back({.name = row.name,
                           .points = {{measure.cpu_ms, measure.error.delta_e,
                                       fmt::format("{}: {:.1f} dB", row.name, measure.error.psnr_db)}},
                           .mark = PlotMark::Dots});
  }
  return make_svg_plot(plot);
}

HtmlTable table_of(const RenderingReport& report, bool is_near) {
  HtmlTable table;
  table.caption = is_near ? "Near" : "Far";
  table.columns = {"row", "CPU ms", "over the main path", "wall ms", "segments", "PSNR dB", "SSIM",
                   "dE",  "MB"};
  const RenderingMeasure& main = is_near ? report.rows.front().near : report.rows.front().far;
  for (const RenderingOutcome& row : report.rows) {
    if (!row.trouble.empty()) {
      table.rows.push_back({row.name, row.trouble, "", "", "", "", "", "", ""});
      continue;
    }
    const RenderingMeasure& m = is_near ? row.near : row.far;
    const bool loses = m.cpu_ms > main.cpu_ms && m.error.delta_e > main.error.delta_e;
    table.rows.push_back(
        {row.name, fmt::format("{:.1f}", m.cpu_ms),
         HtmlCell(fmt::format("{:.2f}", m.cpu_ms / main.cpu_ms), loses ? HtmlMark::Bad : HtmlMark::None),
         fmt::format("{:.1f}", m.wall_ms), fmt::format("{:.0f}", m.drawn_segments),
         fmt::format("{:.1f}", m.error.psnr_db), fmt::format("{:.4f}", m.error.ssim),
         fmt::format("{:.2f}", m.error.delta_e), fmt::format("{:.1f}", row.memory_mb)});
  }
  return table;
}

}  // namespace

std::string rendering_page(const RenderingReportDesc& desc, const RenderingReport& report) {
  HtmlPage page("Rendering: error against time");
  page.paragraph(fmt::format(
      "Scene {}: {} strands at rest, {} x {} pixels. Processor: {}. OpenGL: {}. Every row drew the same "
      "strands, turn by "
      "turn; the median of {} turns counts. Errors are those of the hair's pixels, against tiles drawn at "
      "four times the "
      "sides with the finest strands and light. Far is {:g} times as far away.",
      desc.scene.name, report.strand_count, desc.size.width, desc.size.height, report.device_tiles,
      report.device_gl.empty() ? "none" : report.device_gl, desc.rounds, desc.far_factor));
  std::string losers;
  for (const RenderingOutcome& row : report.rows) {
    const RenderingOutcome& main = report.rows.front();
    const auto loses = [](const RenderingMeasure& a, const RenderingMeasure& b) {
      return a.cpu_ms > b.cpu_ms && a.error.delta_e > b.error.delta_e;
    };
    if (row.trouble.empty() && loses(row.near, main.near) && loses(row.far, main.far))
      losers += (losers.empty() ? "" : ", ") + row.name;
  }
  page.answer(losers.empty()
                  ? "No row is both slower and further from the truth than the main path near and far."
                  : "Slower and further from the truth than the main path, near and far: " + losers + ".");
  for (const bool is_near : {true, false}) {
    page.heading(is_near ? "Near" : "Far");
    page.table(table_of(report, is_near));
    page.figure(plot_of(report, is_near), "Down and to the left is better.");
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

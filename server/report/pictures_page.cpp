// Text, table and page of the pictures report.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/plot/svg_plot.h"
#include "server/report/html_page.h"
#include "server/report/pictures_study.h"
#include "server/report/report_files.h"

namespace strandcast {
namespace {

constexpr int kPairQuality = 90;

constexpr const char* kFittedUse = "fitted";
constexpr const char* kHeldOutUse = "held out";

const char* use_of(const PictureRow& row) {
  return row.view.is_fitted ? kFittedUse : kHeldOutUse;
}

std::string triple(const glm::dvec3& v) {
  return fmt::format("{:.2f} {:.2f} {:.2f}", v.x, v.y, v.z);
}

std::string pair(double ours, double truth) {
  return fmt::format("{:.2f}/{:.2f}", ours, truth);
}

const std::vector<std::string>& figure_names() {
  static const std::vector<std::string> kNames = {
      "hair ratio", "red green blue", "PSNR4",      "SSIM4",      "contrast",   "saturation", "brightest",
      "glow at",    "glow wide",      "skin ratio", "skin PSNR4", "skin SSIM4", "CPU ms"};
  return kNames;
}

/// Figures of a row in the order of their names.
std::vector<std::string> figures(const PictureRow& row) {
  const bool has_skin = row.skin.cells > 0;
  return {fmt::format("{:.2f}", row.hair.luminance_ratio),
          triple(row.hair.ratio),
          fmt::format("{:.1f}", row.hair.psnr_db),
          fmt::format("{:.3f}", row.hair.ssim),
          pair(row.ours.contrast, row.truth.contrast),
          pair(row.ours.saturation, row.truth.saturation),
          pair(row.ours.brightest, row.truth.brightest),
          pair(row.ours.glow_place, row.truth.glow_place),
          pair(row.ours.glow_width, row.truth.glow_width),
          has_skin ? fmt::format("{:.2f}", row.skin.luminance_ratio) : "",
          has_skin ? fmt::format("{:.1f}", row.skin.psnr_db) : "",
          has_skin ? fmt::format("{:.3f}", row.skin.ssim) : "",
          fmt::format("{:.1f}", row.cpu_ms)};
}

/// Names of the methods in their order.
std::vector<std::string> method_names(const PicturesReport& report) {
  std::vector<std::string> names;
  for (const PictureRow& row : report.methods)
    if (std::find(names.begin(), names.end(), row.method) == names.end()) names.push_back(row.method);
  return names;
}

struct NamedMeans {
  std::string name;
  PictureMeans means;
};

std::vector<NamedMeans> all_means(const PicturesReport& report) {
  const auto has = [](bool is_fitted) {
    return [is_fitted](const PictureRow& row) { return row.view.is_fitted == is_fitted; };
  };
  std::vector<NamedMeans> rows = {{kFittedUse, means_of(report.views, has(true))},
                                  {kHeldOutUse, means_of(report.views, has(false))}};
  for (const std::string& name : method_names(report))
    rows.push_back(
        {name, means_of(report.methods, [&](const PictureRow& row) { return row.method == name; })});
  std::erase_if(rows, [](const NamedMeans& row) { return row.means.rows == 0; });
  return rows;
}

/// The sentence of how much longer Cycles takes for a picture as near to the truth; empty where it did not
/// run.
std::string equal_error_text(const PicturesReport& report) {
  for (const PictureRow& row : report.views) {
    const double cycles_s = cycles_s_at(report, row.view.name(), row.hair.psnr_db);
    if (std::isnan(cycles_s)) continue;
    return fmt::format(
        "{}: ours takes {:.1f} ms of the processors, Cycles {:.2f} s for {:.1f} dB: {:.0f} times as long.",
        row.view.name(), row.cpu_ms, cycles_s, row.hair.psnr_db, 1e3 * cycles_s / row.cpu_ms);
  }
  return {};
}

std::string flicker_text(const FlickerRow& row) {
  return fmt::format(
      "{}, head turning by 90 degrees a second: flicker {:.2f} times that of 16 samples a pixel ({:.4f}, "
      "{:.4f})",
      row.view, row.ratio(), row.ours, row.supersampled);
}

/// The sentence of which method comes nearest to the truth.
std::string nearest_text(const PicturesReport& report) {
  const NamedMeans* nearest = nullptr;
  const std::vector<NamedMeans> rows = all_means(report);
  for (const NamedMeans& row : rows)
    if (row.name != kFittedUse && row.name != kHeldOutUse &&
        (nearest == nullptr || row.means.psnr_db > nearest->means.psnr_db))
      nearest = &row;
  if (nearest == nullptr) return {};
  return fmt::format("Of the methods {} is nearest to the truth: {:.2f} dB, in {:.1f} ms of the processors.",
                     nearest->name, nearest->means.psnr_db, nearest->means.cpu_ms);
}

/// Nearness against time, a point a method.
std::string method_plot(const PicturesReport& report) {
  PlotDesc plot;
  plot.title = "Methods";
  plot.x.title = "processor time of a picture, ms";
  plot.y.title = "PSNR4 of hair, dB";
  plot.y.scale = PlotScale::Linear;
  for (const auto& [name, m] : all_means(report)) {
    if (name == kFittedUse || name == kHeldOutUse) continue;
    plot.series.push_back({.name = name,
                           .points = {{m.cpu_ms, m.psnr_db, fmt::format("{}: SSIM4 {:.3f}", name, m.ssim)}},
                           .mark = PlotMark::Dots});
  }
  return make_svg_plot(plot);
}

/// Sentences about views whose truth is of other strands.
std::vector<std::string> stale_texts(const PicturesReport& report) {
  constexpr double kStale = 0.02;
  std::vector<std::string> texts;
  for (const PictureRow& row : report.views)
    if (row.misplaced > kStale)
      texts.push_back(
          fmt::format("{}: {:.0f} % of the hair is elsewhere in the truth, which is of other strands; "
                      "--blender --keep makes it again.",
                      row.view.name(), 100.0 * row.misplaced));
  return texts;
}

/// Returns our picture, the truth and their difference side by side.
Image side_by_side(const PictureRow& row) {
  const Image truth = shown_cells(row.truth_cells);
  const Image off = shown_difference(row.cells, row.truth_cells);
  Image sheet{row.shown.width * 3, row.shown.height, {}};
  sheet.rgba.resize(size_t{sheet.width} * sheet.height * 4);
  const size_t bytes = size_t{row.shown.width} * 4;
  for (uint32_t y = 0; y < sheet.height; ++y) {
    const Image* const parts[] = {&row.shown, &truth, &off};
    for (size_t part = 0; part < 3; ++part)
      std::copy_n(parts[part]->rgba.begin() + static_cast<ptrdiff_t>(y * bytes), bytes,
                  sheet.rgba.begin() + static_cast<ptrdiff_t>((size_t{y} * 3 + part) * bytes));
  }
  return sheet;
}

HtmlTable view_table(const PicturesReport& report) {
  HtmlTable table;
  table.caption = "Ours over or beside the truth (ours/truth)";
  table.columns = {"view", "use"};
  table.columns.insert(table.columns.end(), figure_names().begin(), figure_names().end());
  for (const PictureRow& row : report.views) {
    std::vector<HtmlCell> cells = {row.view.name(), use_of(row)};
    for (const std::string& figure : figures(row)) cells.emplace_back(figure);
    table.rows.push_back(std::move(cells));
  }
  return table;
}

HtmlTable mean_table(const PicturesReport& report) {
  HtmlTable table;
  table.columns = {"pictures", "how many", "hair ratio", "PSNR4", "SSIM4", "skin PSNR4", "CPU ms"};
  for (const auto& [name, m] : all_means(report))
    table.rows.push_back({name, fmt::format("{}", m.rows), fmt::format("{:.2f}", m.ratio),
                          fmt::format("{:.2f}", m.psnr_db), fmt::format("{:.3f}", m.ssim),
                          fmt::format("{:.1f}", m.skin_psnr_db), fmt::format("{:.1f}", m.cpu_ms)});
  return table;
}

}  // namespace

std::string pictures_text(const PicturesReport& report) {
  std::string text = fmt::format(
      "{:26} {:8} {:>5} {:>14} {:>5} {:>5} {:>9} {:>9} {:>9} {:>9} {:>9} {:>5} {:>5} {:>5} {:>6}\n", "view",
      "use", "ratio", "red green blue", "PSNR4", "SSIM4", "contrast", "satur.", "brightest", "glow at",
      "wide", "skin", "PSNR4", "SSIM4", "ms");
  for (const PictureRow& row : report.views) {
    const std::vector<std::string> f = figures(row);
    text += fmt::format(
        "{:26} {:8} {:>5} {:>14} {:>5} {:>5} {:>9} {:>9} {:>9} {:>9} {:>9} {:>5} {:>5} {:>5} {:>6}\n",
        row.view.name(), use_of(row), f[0], f[1], f[2], f[3], f[4], f[5], f[6], f[7], f[8], f[9], f[10],
        f[11], f[12]);
  }
  text += fmt::format("\n{:34} {:>5} {:>6} {:>6} {:>6} {:>10} {:>8}\n", "means", "views", "ratio", "PSNR4",
                      "SSIM4", "skin PSNR4", "ms");
  for (const auto& [name, m] : all_means(report))
    text += fmt::format("{:34} {:>5} {:>6.2f} {:>6.2f} {:>6.3f} {:>10.1f} {:>8.1f}\n", name, m.rows, m.ratio,
                        m.psnr_db, m.ssim, m.skin_psnr_db, m.cpu_ms);
  for (const FlickerRow& row : report.flicker) text += flicker_text(row) + "\n";
  for (const CyclesRow& row : report.cycles)
    text += fmt::format("Cycles, {} samples, {}: {:.2f} s, PSNR4 {:.1f}, SSIM4 {:.3f}\n", row.samples,
                        row.view, row.cpu_s, row.hair.psnr_db, row.hair.ssim);
  if (const std::string equal = equal_error_text(report); !equal.empty()) text += equal + "\n";
  if (const std::string nearest = nearest_text(report); !nearest.empty()) text += nearest + "\n";
  for (const std::string& stale : stale_texts(report)) text += stale + "\n";
  return text;
}

std::string pictures_csv(const PicturesReport& report) {
  CsvFile csv({"view",
               "use",
               "method",
               "hair_ratio",
               "ratio_red",
               "ratio_green",
               "ratio_blue",
               "psnr4_db",
               "ssim4",
               "contrast",
               "true_contrast",
               "saturation",
               "true_saturation",
               "brightest",
               "true_brightest",
               "glow_place",
               "true_glow_place",
               "glow_width",
               "true_glow_width",
               "skin_ratio",
               "skin_psnr4_db",
               "skin_ssim4",
               "misplaced",
               "cpu_ms"});
  for (const auto* rows : {&report.views, &report.methods})
    for (const PictureRow& row : *rows) {
      std::vector<std::string> cells = {row.view.name(), use_of(row), row.method};
      for (const double value : {row.hair.luminance_ratio,
                                 row.hair.ratio.x,
                                 row.hair.ratio.y,
                                 row.hair.ratio.z,
                                 row.hair.psnr_db,
                                 row.hair.ssim,
                                 row.ours.contrast,
                                 row.truth.contrast,
                                 row.ours.saturation,
                                 row.truth.saturation,
                                 row.ours.brightest,
                                 row.truth.brightest,
                                 row.ours.glow_place,
                                 row.truth.glow_place,
                                 row.ours.glow_width,
                                 row.truth.glow_width,
                                 row.skin.luminance_ratio,
                                 row.skin.psnr_db,
                                 row.skin.ssim,
                                 row.misplaced,
                                 row.cpu_ms})
        cells.push_back(csv_number(value));
      csv.add_row(cells);
    }
  return csv.text();
}

std::string pictures_page(const PicturesReport& report) {
  HtmlPage page("Pictures beside a path tracer");
  page.paragraph(
      "The built-in scene's drawn strands, head, camera and lights, drawn by us and by Blender's Cycles with "
      "the "
      "rough fibre of Chiang et al. Figures are of cells of 4 x 4 pixels, PSNR and SSIM of what a screen "
      "shows. "
      "Ratios are of mean linear light. Brightest is the brightest hundredth of the hair; glow is its "
      "brightest "
      "row, from the top of the hair (0) to the bottom (1). Shading may be fitted to the fitted views only.");
  const std::string equal = equal_error_text(report);
  std::string answer;
  for (const auto& [name, m] : all_means(report)) {
    if (name == kFittedUse || name == kHeldOutUse)
      answer += fmt::format("{}: {:.2f} times the truth's light, {:.1f} dB, SSIM {:.3f}. ", name, m.ratio,
                            m.psnr_db, m.ssim);
  }
  page.answer(answer + equal);
  for (const std::string& stale : stale_texts(report)) page.paragraph(stale);
  page.heading("Means");
  page.table(mean_table(report));
  if (!report.methods.empty()) {
    page.paragraph(fmt::format("Methods drew some of the views; OpenGL: {}. {}",
                               report.device_gl.empty() ? "none" : report.device_gl, nearest_text(report)));
    page.figure(method_plot(report), "Up and to the left is better.");
  }
  for (const FlickerRow& row : report.flicker) page.paragraph(flicker_text(row) + ".");
  page.heading("Views");
  page.table(view_table(report));
  page.heading("Ours, truth, and where ours is brighter");
  for (const PictureRow& row : report.views)
    if (const auto jpeg = encode_jpeg(side_by_side(row), kPairQuality))
      page.picture(*jpeg, fmt::format("{}, {}: {:.1f} dB", row.view.name(), use_of(row), row.hair.psnr_db));
  return page.text();
}

}  // namespace strandcast

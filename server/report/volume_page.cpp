#include "server/report/volume_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "common/plot/svg_plot.h"
#include "server/report/html_page.h"
#include "server/report/report_files.h"

namespace strandcast {
namespace {

// Of a hair, for what Sams 2014, 4.2 asks: force that it breaks at (Robbins 2012, "Chemical and Physical
// Behavior of Human Hair": about 1 N for 80 micrometres), mass per length of that width at 1,320 kg/m^3, and
// a long one in a hard shake.
constexpr double kBreakingN = 1.0;
constexpr double kLinearDensityKgPm = 6.6e-6;
constexpr double kLongHairM = 0.5;
constexpr double kHardShakeMps2 = 10.0 * 9.81;

bool is_plain(const VolumeError& error, uint32_t smoothing, VolumeHairs hairs) {
  return error.interval == 1 && error.smoothing == smoothing && error.hairs == hairs;
}

/// The one of guides with so many cells, smoothed as the truth; nullptr without it.
const VolumeError* find_guides(const VolumeStudy& study, uint32_t resolution) {
  for (const VolumeError& error : study.errors)
    if (is_plain(error, kTrueSmoothing, VolumeHairs::Guides) && error.resolution == resolution) return &error;
  return nullptr;
}

template <class Row>
const Row* find_by_name(const std::vector<Row>& rows, const std::string& name) {
  const auto found = std::find_if(rows.begin(), rows.end(), [&](const Row& row) { return row.name == name; });
  return found == rows.end() ? nullptr : &*found;
}

std::string volume_percent(double share) {
  return fmt::format("{:.1f} %", 100.0 * share);
}

void add_errors(HtmlPage& page, const VolumeStudy& study) {
  page.heading("How well a volume knows its hair");
  page.paragraph(
      fmt::format("{} guides out of {} hairs of {} vertices, at moments of a shake of 3 g. The truth is the "
                  "volume of all hairs on {} "
                  "cells, smoothed {} time(s); errors are root mean squares at the guides' vertices, over "
                  "those of the truth. Coarse "
                  "cells blur, fine ones see single guides instead of hair.",
                  study.guide_count, study.hair_count, study.vertex_count, kTrueResolution, kTrueSmoothing));
  page.figure(volume_plot(study),
              "Error of the density against processor time of a step: of whom, how often smoothed, and made "
              "every so many steps. From the left: more and more cells.");
  HtmlTable table{
      "Every volume that was tried",
      {"cells", "cell, mm", "smoothed", "made every", "of", "density", "slope", "velocity", "ms a step"},
      {}};
  for (const VolumeError& error : study.errors)
    table.rows.push_back({fmt::format("{}", error.resolution), fmt::format("{:.1f}", 1e3f * error.cell_m),
                          fmt::format("{}", error.smoothing),
                          error.interval == 1 ? "step" : fmt::format("{} steps", error.interval),
                          to_string(error.hairs), volume_percent(error.density),
                          volume_percent(error.gradient), volume_percent(error.velocity),
                          fmt::format("{:.2f}", error.cpu_ms)});
  page.table(table);
}

void add_scatters(HtmlPage& page, const VolumeStudy& study) {
  page.heading("How strands get into it");
  page.paragraph(fmt::format(
      "{} samples of all hairs into {} cells, without smoothing, each way against a sum in "
      "double. OpenGL: {}. "
      "Woodhouse 2017 (4.2.4) tried hashing, then counting, and kept drawing points, on graphics cards of "
      "2011; the ways in use here "
      "find the box of the hair as well, and give the same bits every time.",
      study.scatter_samples, study.scatter_resolution,
      study.scatter_device.empty() ? "not there, so that only the host's way was tried"
                                   : study.scatter_device));
  HtmlTable table{"", {"way", "", "ms", "density", "momentum", "same bits", "samples lost"}, {}};
  for (const ScatterResult& scatter : study.scatters)
    table.rows.push_back(
        {scatter.name,
         scatter.what,
         fmt::format("{:.2f}", scatter.cpu_ms),
         fmt::format("{:.1e}", scatter.density),
         fmt::format("{:.1e}", scatter.momentum),
         {scatter.is_repeatable ? "yes" : "no", scatter.is_repeatable ? HtmlMark::None : HtmlMark::Bad},
         volume_percent(scatter.lost_share)});
  page.table(table);
}

void add_outcomes(HtmlPage& page, const VolumeStudy& study) {
  page.heading("What hair does with it");
  page.paragraph(
      "A tuft of guides is shaken for 20 s and held still; how it lies half a minute later. Volume is that "
      "of the groom; "
      "crowded are vertices that lie more than twice as dense as in the groom; from step to step is the "
      "amplitude of what "
      "changes its sign with every step.");
  HtmlTable table{
      "", {"volume", "speed, mm/s", "step to step, mm", "of the groom's volume", "crowded", "ms a step"}, {}};
  for (const VolumeOutcome& outcome : study.outcomes)
    table.rows.push_back({outcome.name, fmt::format("{:.2f}", 1e3 * outcome.speed_rms_mps),
                          fmt::format("{:.4f}", 1e3 * outcome.nyquist_m),
                          volume_percent(outcome.volume_share), volume_percent(outcome.crowded_share),
                          fmt::format("{:.3f}", outcome.step_cpu_ms)});
  page.table(table);
}

/// What the sources describe and no row of the solver table has, each with a number of this run that says
/// why.
void add_covered(HtmlPage& page, const VolumeStudy& study) {
  page.heading("What the sources describe besides");
  const VolumeOutcome* const none = find_by_name(study.outcomes, "no volume");
  const VolumeOutcome* const usual = find_by_name(study.outcomes, "as shipped");
  if (none != nullptr && usual != nullptr)
    page.paragraph(
        fmt::format("Hair as a continuum (Hadap and Magnenat-Thalmann 2001, named by Zappe 2020) and webbing "
                    "(McAdams and others 2009; Sams 2014, "
                    "4.3) correct the velocities of strands by a volume's. That is what friction and "
                    "repulsion do, step by step, with "
                    "an implicit term in the place of a pressure solve: a tuft keeps {} of its volume "
                    "instead of {}, and {} of its "
                    "vertices are crowded instead of {}.",
                    volume_percent(usual->volume_share), volume_percent(none->volume_share),
                    volume_percent(usual->crowded_share), volume_percent(none->crowded_share)));
  if (const VolumeError* const same = find_guides(study, kTrueResolution); same != nullptr)
    page.paragraph(fmt::format(
        "Strips (Koh and Huang 2001; Woodhouse 2017, 2.1) move many hairs as one patch, to simulate fewer "
        "vertices. "
        "Guides that stand for "
        "the hairs around them do so with {} of the vertices here, and know the density of all hair within "
        "{} on the same "
        "cells, without taking any freedom from strands.",
        volume_percent(static_cast<double>(study.guide_count) / study.hair_count),
        volume_percent(same->density)));
  page.paragraph(fmt::format(
      "Breaking (Sams 2014, 4.2): a hair of {:.0f} cm in a shake of 10 g pulls at its root with {:.2f} "
      "mN, and breaks at {:.0f} N, "
      "{:.0f} times that. No head breaks hair by moving; a threshold that could ever be reached "
      "would be an effect, and "
      "none is built.",
      100.0 * kLongHairM, 1e3 * kLinearDensityKgPm * kLongHairM * kHardShakeMps2, kBreakingN,
      kBreakingN / (kLinearDensityKgPm * kLongHairM * kHardShakeMps2)));
}

}  // namespace

std::string volume_summary(const VolumeStudy& study) {
  std::string text;
  if (const VolumeError* const same = find_guides(study, kTrueResolution); same != nullptr)
    text += fmt::format(
        "{} guides know the density of {} hairs within {} on the same {} cells of {:.0f} mm, in {:.2f} ms a "
        "step.\n",
        study.guide_count, study.hair_count, volume_percent(same->density), same->resolution,
        1e3f * same->cell_m, same->cpu_ms);
  for (const uint32_t resolution : {kTrueResolution / 2, 2 * kTrueResolution})
    if (const VolumeError* const other = find_guides(study, resolution); other != nullptr)
      text += fmt::format("On {} cells they {} by {}, in {:.2f} ms.\n", resolution,
                          resolution < kTrueResolution ? "blur it" : "see single guides, and miss it",
                          volume_percent(other->density), other->cpu_ms);
  const ScatterResult* const atomics = find_by_name(study.scatters, "atomics");
  for (const ScatterResult& scatter : study.scatters)
    text += fmt::format(
        "{}: {:.2f} ms{}, density within {:.1e}{}\n", scatter.name, scatter.cpu_ms,
        atomics == nullptr ? "" : fmt::format(" ({:.2f} of atomics)", scatter.cpu_ms / atomics->cpu_ms),
        scatter.density,
        scatter.lost_share > 0.0 ? fmt::format(", {} of samples lost", volume_percent(scatter.lost_share))
                                 : "");
  for (const VolumeOutcome& outcome : study.outcomes)
    text += fmt::format("{}: {:.2f} mm/s at rest, {} of the groom's volume, {} crowded, {:.3f} ms a step\n",
                        outcome.name, 1e3 * outcome.speed_rms_mps, volume_percent(outcome.volume_share),
                        volume_percent(outcome.crowded_share), outcome.step_cpu_ms);
  return text;
}

std::string volume_error_csv(const VolumeStudy& study) {
  CsvFile csv({"resolution", "cell_m", "smoothing", "interval", "hairs", "density", "gradient", "velocity",
               "cpu_ms"});
  for (const VolumeError& error : study.errors)
    csv.add_row({fmt::format("{}", error.resolution), csv_number(error.cell_m),
                 fmt::format("{}", error.smoothing), fmt::format("{}", error.interval),
                 to_string(error.hairs), csv_number(error.density), csv_number(error.gradient),
                 csv_number(error.velocity), csv_number(error.cpu_ms)});
  return csv.text();
}

std::string volume_scatter_csv(const VolumeStudy& study) {
  CsvFile csv({"scatter", "in_use", "cpu_ms", "density", "momentum", "repeatable", "lost_share"});
  for (const ScatterResult& scatter : study.scatters)
    csv.add_row({scatter.name, scatter.is_in_use ? "1" : "0", csv_number(scatter.cpu_ms),
                 csv_number(scatter.density), csv_number(scatter.momentum), scatter.is_repeatable ? "1" : "0",
                 csv_number(scatter.lost_share)});
  return csv.text();
}

std::string volume_outcome_csv(const VolumeStudy& study) {
  CsvFile csv({"volume", "speed_rms_mps", "nyquist_m", "volume_share", "crowded_share", "step_cpu_ms"});
  for (const VolumeOutcome& outcome : study.outcomes)
    csv.add_row({outcome.name, csv_number(outcome.speed_rms_mps), csv_number(outcome.nyquist_m),
                 csv_number(outcome.volume_share), csv_number(outcome.crowded_share),
                 csv_number(outcome.step_cpu_ms)});
  return csv.text();
}

std::string volume_plot(const VolumeStudy& study) {
  PlotDesc plot;
  plot.title = "What a volume knows of the density of hair";
  plot.x = {"processor time of a step, ms"};
  plot.y = {"error of the density"};
  for (const VolumeHairs hairs : {VolumeHairs::Guides, VolumeHairs::All})
    for (uint32_t smoothing = 0; smoothing <= kMaxVolumeSmoothing; ++smoothing) {
      PlotSeries series;
      series.name = fmt::format("{}, {}x", to_string(hairs), smoothing);
      for (const VolumeError& error : study.errors)
        if (is_plain(error, smoothing, hairs))
          series.points.push_back({error.cpu_ms, error.density, fmt::format("{} cells", error.resolution)});
      if (!series.points.empty()) plot.series.push_back(std::move(series));
    }
  std::map<uint32_t, PlotSeries> by_interval;
  for (const VolumeError& error : study.errors) {
    if (error.interval == 1) continue;
    PlotSeries& series = by_interval[error.interval];
    series.name = fmt::format("guides, {}x, every {}", error.smoothing, error.interval);
    series.points.push_back({error.cpu_ms, error.density, fmt::format("{} cells", error.resolution)});
  }
  for (auto& [interval, series] : by_interval) plot.series.push_back(std::move(series));
  return make_svg_plot(plot);
}

std::string volume_page(const VolumeStudy& study) {
  HtmlPage page("Hair that acts on hair: error against time");
  page.code(volume_summary(study));
  add_errors(page, study);
  add_scatters(page, study);
  add_outcomes(page, study);
  add_covered(page, study);
  return page.text();
}

Status save_volume_study(const VolumeStudy& study, const std::filesystem::path& folder) {
  RETURN_IF_ERROR(save_text(folder / "volume_error.csv", volume_error_csv(study)));
  RETURN_IF_ERROR(save_text(folder / "volume_scatter.csv", volume_scatter_csv(study)));
  RETURN_IF_ERROR(save_text(folder / "volume_outcome.csv", volume_outcome_csv(study)));
  RETURN_IF_ERROR(save_text(folder / "volume_error.svg", volume_plot(study)));
  return save_text(folder / kVolumePage, volume_page(study));
}

}  // namespace strandcast

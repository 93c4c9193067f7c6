#include "server/report/coherence_study.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "common/plot/svg_plot.h"
#include "server/report/hair_reality.h"
#include "server/report/html_page.h"
#include "server/report/report_files.h"
#include "server/report/svg_bars.h"

namespace strandcast {
namespace {

constexpr int kSheetJpegQuality = 85;

std::string coherence_percent(double share) {
  return fmt::format("{:.1f} %", 100.0 * share);
}

const CoherenceOutcome* find_outcome(const CoherenceStudy& study, const std::string& name) {
  for (const CoherenceOutcome& outcome : study.outcomes)
    if (outcome.row.name == name) return &outcome;
  return nullptr;
}

/// What the two rows that a reader asks about have to say.
std::string coherence_answer(const CoherenceStudy& study) {
  const CoherenceOutcome* const alone = find_outcome(study, "direct_rod");
  const CoherenceOutcome* const full = find_outcome(study, "direct_rod, full");
  if (alone == nullptr || full == nullptr) return "";
  return fmt::format(
      "In full quality {} of the hair's motion is against the hair around it, and {} of the vertices are "
      "alone. The same rods without each other and without air have {} and {}.",
      coherence_percent(full->coherence.incoherent_share()), coherence_percent(full->coherence.lone_share()),
      coherence_percent(alone->coherence.incoherent_share()),
      coherence_percent(alone->coherence.lone_share()));
}

HtmlTable coherence_table(const CoherenceStudy& study) {
  HtmlTable table{"",
                  {"row", "steps a second", "against its neighbours", "motion, m/s", "alone", "order",
                   "fastest over scalp", "off the groom, mm", "at rest, mm/s", "ms a step"},
                  {}};
  for (const CoherenceOutcome& outcome : study.outcomes)
    table.rows.push_back(
        {outcome.row.name,
         outcome.substeps == 1
             ? fmt::format("{:g}", outcome.row.step_rate_hz)
             : fmt::format("{:g} of {} substeps", outcome.row.step_rate_hz, outcome.substeps),
         coherence_percent(outcome.coherence.incoherent_share()),
         fmt::format("{:.2f}", outcome.coherence.motion_mps()),
         coherence_percent(outcome.coherence.lone_share()), fmt::format("{:.3f}", outcome.coherence.order()),
         fmt::format("{:.1f}", outcome.fastest_over_scalp), fmt::format("{:.3f}", 1e3 * outcome.rest_rms_m),
         fmt::format("{:.2f}", 1e3 * outcome.rest_speed_mps), fmt::format("{:.2f}", outcome.step_cpu_ms)});
  return table;
}

void add_shake(HtmlPage& page, const CoherenceStudy& study) {
  page.heading("A shake of the head");
  page.paragraph(fmt::format(
      "{} strands of {} vertices on {}. The head says no for some seconds: {:g} degrees to either side, {:g} "
      "times a second, without wind. Real hair moves as a whole in it, in locks.",
      study.strand_count, study.vertex_count, study.device, kShakeYawDeg, kShakeHz));
  page.paragraph(
      fmt::format("Motion is that seen from the head, which turns with it. Against its neighbours is the "
                  "energy of motion relative to the mean of other strands' vertices within {:g} mm. It is "
                  "given as a share: over the energy relative to the mean of all hair. Alone are vertices "
                  "with fewer than {} such neighbours. Motion itself is a root mean square. Order is the "
                  "length of the mean direction of the segments around a segment: 1 where all are parallel. "
                  "The first quarter of each strand goes with the head and is left out.",
                  1e3 * kNeighbourReachM, kLeastNeighbours));
  page.figure(coherence_bars(study),
              "Motion against the neighbours, of all motion: less is more of a whole.");
  page.table(coherence_table(study));
  page.paragraph(
      "A model whose hair hardly moves has a large share of little. Contact is friction and repulsion "
      "between strands; full is contact and air. Fastest over scalp is the fastest vertex over the fastest "
      "root: hair that is thrown about is many times as fast as the skin. Off the groom and at rest say how "
      "the hair lies some seconds after the shake: it has to come back, and to stand still.");
  page.figure(coherence_cost_plot(study),
              "Motion against the neighbours against what a step takes. Down and to the left is better.");
  page.figure(coherence_time_plot(study), "Motion against the neighbours over the time of the shake.");
  if (study.sheet.rgba.empty()) return;
  if (const auto jpeg = encode_jpeg(study.sheet, kSheetJpegQuality))
    page.picture(
        *jpeg, fmt::format("Half a turn of the shake, in eighths of a period from the left. From above: {}.",
                           fmt::join(study.sheet_rows, "; ")));
}

}  // namespace

std::string coherence_text(const CoherenceStudy& study) {
  std::string text = fmt::format("{:<32} {:>8} {:>7} {:>7} {:>6} {:>8} {:>9} {:>9} {:>8}\n", "", "against",
                                 "m/s", "alone", "order", "fastest", "off, mm", "mm/s", "ms/step");
  for (const CoherenceOutcome& outcome : study.outcomes)
    text += fmt::format("{:<32} {:>7.1f}% {:>7.2f} {:>6.1f}% {:>6.3f} {:>8.1f} {:>9.3f} {:>9.2f} {:>8.2f}\n",
                        outcome.row.name, 100.0 * outcome.coherence.incoherent_share(),
                        outcome.coherence.motion_mps(), 100.0 * outcome.coherence.lone_share(),
                        outcome.coherence.order(), outcome.fastest_over_scalp, 1e3 * outcome.rest_rms_m,
                        1e3 * outcome.rest_speed_mps, outcome.step_cpu_ms);
  return text + reality_text(study.reality);
}

std::string coherence_csv(const CoherenceStudy& study) {
  CsvFile csv({"row", "solver", "contact", "air", "step_rate_hz", "substeps", "incoherent_share",
               "motion_mps", "lone_share", "order", "fastest_over_scalp", "rest_rms_m", "rest_speed_mps",
               "step_cpu_ms"});
  for (const CoherenceOutcome& outcome : study.outcomes)
    csv.add_row({outcome.row.name, outcome.row.solver, outcome.row.company.has_contact ? "1" : "0",
                 outcome.row.company.has_air ? "1" : "0", csv_number(outcome.row.step_rate_hz),
                 fmt::format("{}", outcome.substeps), csv_number(outcome.coherence.incoherent_share()),
                 csv_number(outcome.coherence.motion_mps()), csv_number(outcome.coherence.lone_share()),
                 csv_number(outcome.coherence.order()), csv_number(outcome.fastest_over_scalp),
                 csv_number(outcome.rest_rms_m), csv_number(outcome.rest_speed_mps),
                 csv_number(outcome.step_cpu_ms)});
  return csv.text();
}

std::string coherence_bars(const CoherenceStudy& study) {
  BarDesc bars;
  bars.title = "Motion against the neighbours";
  bars.y_title = "% of all motion";
  bars.series.push_back({"against the neighbours", {}, 0});
  for (const CoherenceOutcome& outcome : study.outcomes) {
    bars.groups.push_back(outcome.row.name);
    bars.series.front().value.push_back(100.0 * outcome.coherence.incoherent_share());
  }
  return make_svg_bars(bars);
}

std::string coherence_cost_plot(const CoherenceStudy& study) {
  PlotDesc plot;
  plot.title = "Motion against the neighbours against time";
  plot.x = {"processor time of a step, ms"};
  plot.y = {"share of all motion", PlotScale::Linear, 0.0};
  for (const CoherenceOutcome& outcome : study.outcomes)
    plot.series.push_back(
        {.name = outcome.row.name,
         .points = {{outcome.step_cpu_ms, outcome.coherence.incoherent_share(), outcome.row.name}},
         .mark = PlotMark::Dots});
  return make_svg_plot(plot);
}

std::string coherence_time_plot(const CoherenceStudy& study) {
  PlotDesc plot;
  plot.title = "Motion against the neighbours over time";
  plot.x = {"time, s", PlotScale::Linear};
  plot.y = {"share of all motion", PlotScale::Linear, 0.0};
  for (const CoherenceOutcome& outcome : study.outcomes) {
    if (!outcome.row.is_main) continue;
    PlotSeries series{outcome.row.name, {}, PlotMark::Line};
    for (const CoherenceMoment& moment : outcome.moments)
      series.points.push_back({moment.time_s, moment.incoherent_share});
    plot.series.push_back(std::move(series));
  }
  return make_svg_plot(plot);
}

std::string coherence_page(const CoherenceStudy& study) {
  HtmlPage page("A head of hair in motion: does it move as one?");
  if (const std::string answer = coherence_answer(study); !answer.empty()) page.answer(answer);
  add_shake(page, study);
  add_reality(page, study.reality);
  return page.text();
}

Status save_coherence_study(const CoherenceStudy& study, const std::filesystem::path& folder) {
  RETURN_IF_ERROR(save_text(folder / "coherence.csv", coherence_csv(study)));
  RETURN_IF_ERROR(save_text(folder / "coherence.svg", coherence_bars(study)));
  return save_text(folder / kCoherencePage, coherence_page(study));
}

}  // namespace strandcast

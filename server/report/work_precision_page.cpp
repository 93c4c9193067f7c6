#include "server/report/work_precision_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "common/base/units.h"
#include "common/plot/svg_plot.h"
#include "server/report/exact_solutions.h"
#include "server/report/html_page.h"
#include "server/report/report_files.h"
#include "server/report/work_precision_devices.h"

namespace strandcast {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kFramesPerS = 1.0 / MotionSet::kFrameS;
// What a budget is for, on the page.
constexpr double kPickStrands = 10'000.0;
constexpr double kBudgetsMs[] = {2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0};

std::string percent(double value) {
  if (std::isnan(value)) return "";
  if (std::isinf(value)) return "unbounded";
  const double shown = 100.0 * value;
  return shown >= 0.01 || shown == 0.0 ? fmt::format("{:.3g} %", shown) : fmt::format("{:.1e} %", shown);
}

std::string number(double value) {
  return std::isnan(value) ? "" : fmt::format("{:.3g}", value);
}

/// Place of a method among those of the report, so that it looks the same in every plot.
int style_of(const WorkReport& report, const std::string& method) {
  std::vector<std::string> seen;
  for (const WorkRecord& record : report.records) {
    const std::string& name = record.setting.row->name;
    if (std::find(seen.begin(), seen.end(), name) == seen.end()) seen.push_back(name);
  }
  // The champion first.
  std::stable_partition(seen.begin(), seen.end(), [](const std::string& name) { return name == kChampion; });
  return static_cast<int>(std::find(seen.begin(), seen.end(), method) - seen.begin());
}

std::vector<std::string> methods_of(const WorkReport& report) {
  std::vector<std::string> methods;
  for (const WorkRecord& record : report.records) {
    const std::string& name = record.setting.row->name;
    if (std::find(methods.begin(), methods.end(), name) == methods.end()) methods.push_back(name);
  }
  std::sort(methods.begin(), methods.end(), [&](const std::string& a, const std::string& b) {
    return style_of(report, a) < style_of(report, b);
  });
  return methods;
}

/// A plot of points with each method's front joined by a line, and of other fronts beside them.
std::string front_plot(const WorkReport& report, const std::vector<WorkPoint>& points, PlotDesc desc,
                       const std::vector<PlotSeries>& beside = {}) {
  std::vector<PlotSeries> fronts;
  for (const std::string& method : methods_of(report)) {
    std::vector<WorkPoint> own;
    std::copy_if(points.begin(), points.end(), std::back_inserter(own),
                 [&](const WorkPoint& point) { return point.method == method; });
    PlotSeries all{method, {}, PlotMark::Dots, style_of(report, method), true, false};
    PlotSeries front{method, {}, PlotMark::LineAndDots, style_of(report, method)};
    for (const WorkPoint& point : own) {
      if (point.error < kWorstPlotted) all.points.push_back(plotted(point));
    }
    for (const size_t i : pareto_front(own)) {
      if (own[i].error < kWorstPlotted) front.points.push_back(plotted(own[i]));
    }
    if (front.points.empty()) continue;
    desc.series.push_back(std::move(all));
    fronts.push_back(std::move(front));
  }
  desc.series.insert(desc.series.end(), fronts.begin(), fronts.end());
  desc.series.insert(desc.series.end(), beside.begin(), beside.end());
  desc.x.title = kFrameTimeTitle;
  return make_svg_plot(desc);
}

std::vector<WorkPoint> points_of(const WorkReport& report, const std::string& test,
                                 const std::string& device) {
  std::vector<WorkPoint> points;
  for (const WorkRecord& record : report.records) {
    if (record.test == test && is_of_device(record, device))
      points.push_back({record.setting.row->name, record.us, record.result.error, to_string(record.setting)});
  }
  return points;
}

/// The front of all models on each other executor, so that one plot shows what the executor is worth.
std::vector<PlotSeries> other_fronts(const WorkReport& report, MotionHair hair, const std::string& device) {
  std::vector<PlotSeries> fronts;
  auto style = static_cast<int>(methods_of(report).size());
  for (const std::string& other : front_devices(report)) {
    if (other == device) continue;
    PlotSeries front{"best" + on_device(other), {}, PlotMark::LineAndDots, style++};
    const std::vector<WorkPoint> points = motion_points(report, hair, other);
    for (const size_t i : pareto_front(points))
      if (points[i].error < kWorstPlotted) front.points.push_back(plotted(points[i]));
    if (!front.points.empty()) fronts.push_back(std::move(front));
  }
  return fronts;
}

/// Whether any model beats the champion on this hair, in a sentence.
std::string hair_summary(const WorkReport& report, MotionHair hair, const std::string& device) {
  return fmt::format(
      "On {} hair, {}{}: does any other model beat {}, in error and time, below an error of {:g} %? {}",
      to_string(hair), report.motion_name, device.empty() ? "" : "," + on_device(device), kChampion,
      100.0 * kChampionErrorLimit,
      beaten_sentence(motion_points(report, hair, device), kChampion, kChampionErrorLimit));
}

std::string executors_words(const WorkReport& report) {
  if (report.executors.empty()) return "none: every model as its double-precision reference";
  std::vector<std::string> names;
  for (const ExecutorInfo& executor : report.executors) names.push_back(executor.name);
  return fmt::format("{}", fmt::join(names, " and on "));
}

void add_picks(HtmlPage& page, const WorkReport& report, MotionHair hair, const std::string& device) {
  const std::vector<WorkPoint> points = motion_points(report, hair, device);
  HtmlTable table;
  table.caption = fmt::format(
      "The most exact setting within a budget for {:.0f} {} strands at 60 frames per second{}, simulation "
      "only. "
      "\"strandcast-report recommend\" answers for a scene of yours.",
      kPickStrands, to_string(hair), on_device(device));
  table.columns = {"budget per frame", "pick", "takes", "error"};
  std::optional<size_t> before;
  for (const double budget_ms : kBudgetsMs) {
    const auto best = best_within(points, budget_ms * kUsPerMs / kPickStrands);
    if (best && best == before) continue;  // a larger budget buys nothing
    before = best;
    if (!best) {
      table.rows.push_back({fmt::format("{:g} ms", budget_ms), "nothing is that fast", "", ""});
      continue;
    }
    const WorkPoint& point = points[*best];
    table.rows.push_back({fmt::format("{:g} ms", budget_ms), point.label,
                          fmt::format("{:.3g} ms", point.us * kPickStrands / kUsPerMs),
                          percent(point.error)});
  }
  page.table(table);
}

/// The three errors of each row: at one common setting, and of its most exact run.
void add_error_parts(HtmlPage& page, const WorkReport& report, MotionHair hair) {
  const std::string device = front_devices(report).front();
  HtmlTable table;
  table.caption = fmt::format(
      "{} hair{}, every model's most exact run. Model: the model itself, refined ({} vertices, up to {:g} "
      "Hz, "
      "in "
      "double), "
      "against the rod. Discretisation: this run against the model refined. Float: this run by its kernel "
      "against "
      "double precision. All are RMS distances of vertices over the strand's length.",
      to_string(hair), on_device(device), report.grid.refined_vertices, report.grid.refined_rate_hz);
  table.columns = {"model", "setting",        "microseconds", "error",
                   "model", "discretisation", "float",        "largest stretch"};
  for (const std::string& method : methods_of(report)) {
    const WorkRecord* best = nullptr;
    for (const WorkRecord& record : report.records) {
      if (record.test != motion_test(hair) || record.setting.row->name != method) continue;
      if (!std::isfinite(record.result.error) || !is_of_device(record, device)) continue;
      if (best == nullptr || record.result.error < best->result.error) best = &record;
    }
    if (best == nullptr) {
      table.rows.push_back({method, "no run at any setting", "", "", "", "", "", ""});
      continue;
    }
    table.rows.push_back({method, setting_words(best->setting), number(best->us), percent(best->result.error),
                          percent(best->model_error), percent(best->discretisation_error),
                          percent(best->float_error), percent(best->result.stretch)});
  }
  page.table(table);
}

/// The default effort's run of a test at about 32 vertices and 60 Hz, which every grid has near.
const WorkRecord* common_record(const WorkReport& report, const std::string& test,
                                const std::string& method) {
  constexpr double kVertices = 32.0;
  constexpr double kRateHz = 60.0;
  const WorkRecord* nearest = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const WorkRecord& record : report.records) {
    const RunSetting& setting = record.setting;
    if (record.test != test || setting.row->name != method || setting.substeps != 1) continue;
    const double default_effort = effort_values(*setting.row, {1.0}).front();
    const bool is_default = std::isnan(setting.effort) || setting.effort == default_effort;
    const double off = std::abs(std::log(setting.vertex_count / kVertices)) +
                       std::abs(std::log(setting.rate_hz / kRateHz)) + (is_default ? 0.0 : 10.0);
    if (off < least) {
      least = off;
      nearest = &record;
    }
  }
  return nearest;
}

void add_analytic_tables(HtmlPage& page, const WorkReport& report) {
  HtmlTable table;
  table.caption =
      "Errors against exact solutions at 32 vertices, 60 Hz and default effort (or the nearest run); "
      "- where the model has not the physics.";
  table.columns = {"model"};
  std::vector<const AnalyticTest*> tests;
  for (const AnalyticTest& test : analytic_tests()) {
    const bool has_runs = std::any_of(report.records.begin(), report.records.end(),
                                      [&](const WorkRecord& record) { return record.test == test.name; });
    if (has_runs) tests.push_back(&test);
  }
  for (const AnalyticTest* test : tests) table.columns.push_back(test->name);
  table.columns.insert(table.columns.end(), {"T7 damping", "T5 period", "largest stretch"});
  for (const std::string& method : methods_of(report)) {
    std::vector<HtmlCell> row = {method};
    double damping = kNan;
    double beam_period = kNan;
    double stretch = 0.0;
    for (const AnalyticTest* test : tests) {
      const WorkRecord* record = common_record(report, test->name, method);
      row.push_back(record == nullptr              ? HtmlCell("-")
                    : !record->result.note.empty() ? HtmlCell(record->result.note)
                                                   : HtmlCell(percent(record->result.error)));
      if (record == nullptr) continue;
      stretch = std::max(stretch, record->result.stretch);
      if (!std::isnan(record->result.damping_ratio)) damping = record->result.damping_ratio;
      if (test->name == "T5") beam_period = record->result.period_error;
    }
    row.insert(row.end(),
               {HtmlCell(number(damping)), HtmlCell(percent(beam_period)), HtmlCell(percent(stretch))});
    table.rows.push_back(std::move(row));
  }
  page.table(table);
  HtmlTable key;
  key.columns = {"test", "what is compared"};
  for (const AnalyticTest* test : tests) key.rows.push_back({HtmlCell(test->name), HtmlCell(test->summary)});
  page.table(key);
}

void add_analytic_plot(HtmlPage& page, const WorkReport& report, const std::string& test,
                       const std::string& title) {
  const std::vector<WorkPoint> points = points_of(report, test, front_devices(report).front());
  page.figure(analytic_plot(report, test, title),
              fmt::format("Does another model beat {} here? {}", kChampion,
                          beaten_sentence(points, kChampion, kChampionErrorLimit)));
}

/// T16: how much the droop of the same hair depends on vertices and rate.
void add_droop_spread(HtmlPage& page, const WorkReport& report) {
  HtmlTable table;
  constexpr double kGamma = 10.0;
  const auto shapes = cantilever_shapes();
  const auto shape = std::find_if(shapes.begin(), shapes.end(),
                                  [](const CantileverShape& candidate) { return candidate.gamma == kGamma; });
  table.caption = fmt::format(
      "T16: the droop of the same hair (T1, Gamma {:g}; exactly {:.4f} of its length) over all vertex counts "
      "and rates, default effort.",
      kGamma, shape->y);
  table.columns = {"model", "least", "most", "spread"};
  for (const std::string& method : methods_of(report)) {
    double least = std::numeric_limits<double>::infinity();
    double most = -least;
    for (const WorkRecord& record : report.records) {
      const RunSetting& setting = record.setting;
      if (record.test != "T1 Gamma 10" || setting.row->name != method || std::isnan(record.result.droop))
        continue;
      if (!std::isnan(setting.effort) && setting.effort != effort_values(*setting.row, {1.0}).front())
        continue;
      least = std::min(least, record.result.droop);
      most = std::max(most, record.result.droop);
    }
    if (!(least <= most)) continue;
    table.rows.push_back({method, fmt::format("{:.4f}", least), fmt::format("{:.4f}", most),
                          least > 0.0 ? percent(most / least - 1.0) : "changes sign"});
  }
  if (!table.rows.empty()) page.table(table);
}

void add_method(HtmlPage& page, const WorkReport& report) {
  const WorkGrid& grid = report.grid;
  page.heading("How it was measured");
  const HairConstants hair;
  page.paragraph(fmt::format(
      "Motion set: {} hairs of {:g} m (radius {:g} mm, {:g} kg/m^3, {:g} GPa; air drag {:g}/s) grow from a "
      "ring about a head that follows the {} for {:g} s in gusts; no colliders. Straight hair hangs from the "
      "start; curled and styled hair begins without weight, which sets in with the motion. Errors are root "
      "mean squared distances of the vertices over the length, {:g} times a second.",
      grid.strand_count, MotionSet::kLengthM, 1e3 * hair.radius_m, hair.density_kgpm3,
      1e-9 * hair.young_modulus_pa, MotionSet::kAirDragPerS, report.motion_name, grid.motion_s,
      1.0 / MotionSet::kSampleS));
  const WorkGrid full;
  page.paragraph(fmt::format(
      "Reference: {} in double precision, {} vertices, steps of 1/{:g} s{}. It is one of the models "
      "measured; "
      "what speaks for it are the tests against exact solutions, and {}, another model with another solver, "
      "with as many vertices and steps of 1/{:g} s.",
      kChampion, grid.reference_vertices, grid.reference_rate_hz,
      report.is_quick ? fmt::format(" (coarser than without --quick, which takes {} vertices and 1/{:g} s)",
                                    full.reference_vertices, full.reference_rate_hz)
                      : "",
      kCheckModel, grid.check_rate_hz));
  HtmlTable converged;
  converged.caption = "How far the reference is from";
  converged.columns = {"hair", "itself with steps of half the length", "itself with half the vertices",
                       kCheckModel};
  for (const WorkReport::Converged& set : report.converged)
    converged.rows.push_back({HtmlCell(to_string(set.hair)), HtmlCell(percent(set.time_self_difference)),
                              HtmlCell(percent(set.space_self_difference)),
                              HtmlCell(percent(set.check_difference))});
  page.table(converged);
  page.paragraph(
      fmt::format("Times: {} strands at once on \"{}\", best of several substeps, the device waited for "
                  "after each; a frame is "
                  "1/60 s whatever the rate. Rows without a kernel are timed in double precision on one "
                  "thread. Times are "
                  "of this machine; errors are the same on every one.",
                  report.timed_strands, executors_words(report)));
  page.paragraph(
      "Models without constants of hair are measured as limp chains and as they ship, and skip the tests "
      "that "
      "need stiffness. A load at the tip (T2) is a bead, where the model has one. Not "
      "measured: twisted rings (T11), since a step has no such input; the largest stable stiffness (T8) is "
      "in strandcast-report stability.");
  page.paragraph(fmt::format("Every run, with all its numbers, is in {}.", kWorkPrecisionCsv));
}

}  // namespace

PlotPoint plotted(const WorkPoint& point) {
  return {point.us, point.error,
          fmt::format("{}: {:.3g} % at {:.3g} us", point.label, 100.0 * point.error, point.us)};
}

std::vector<WorkPoint> motion_points(const WorkReport& report, MotionHair hair, const std::string& device) {
  return points_of(report, motion_test(hair), device);
}

std::string work_precision_summary(const WorkReport& report) {
  std::string text;
  const auto add = [&](const std::string& line) {
    if (!line.empty()) text += (text.empty() ? "" : "\n") + line;
  };
  for (const MotionHair hair : report.grid.hairs) {
    for (const std::string& device : front_devices(report)) add(hair_summary(report, hair, device));
    add(devices_summary(report, hair));
  }
  return text;
}

std::string work_precision_csv(const WorkReport& report) {
  CsvFile csv({"test",
               "solver",
               "material",
               "device",
               "vertices",
               "rate_hz",
               "substeps",
               "effort_parameter",
               "effort",
               "us_per_strand_frame",
               "us_median",
               "error",
               "model_error",
               "discretisation_error",
               "float_error",
               "refined_rate_hz",
               "largest_stretch",
               "period_error",
               "damping_over_predicted",
               "droop",
               "value",
               "exact",
               "note"});
  for (const WorkRecord& record : report.records) {
    const RunSetting& setting = record.setting;
    const AnalyticResult& result = record.result;
    const bool was_run = !std::isnan(result.error) || !std::isnan(result.value);
    csv.add_row({record.test,
                 setting.row->name,
                 to_string(setting.material),
                 record.ran_on,
                 std::to_string(setting.vertex_count),
                 csv_number(setting.rate_hz),
                 std::to_string(setting.substeps),
                 setting.row->effort_parameter,
                 csv_number(setting.effort),
                 csv_number(record.us),
                 csv_number(record.median_us),
                 csv_number(result.error),
                 csv_number(record.model_error),
                 csv_number(record.discretisation_error),
                 csv_number(record.float_error),
                 csv_number(record.refined_rate_hz),
                 csv_number(was_run ? result.stretch : kNan),
                 csv_number(result.period_error),
                 csv_number(result.damping_ratio),
                 csv_number(result.droop),
                 csv_number(result.value),
                 csv_number(result.exact),
                 result.note});
  }
  return csv.text();
}

std::string motion_plot(const WorkReport& report, MotionHair hair, const std::string& device) {
  PlotDesc desc;
  desc.title = fmt::format("Error against time{}, {} hair, {}: below and left is better", on_device(device),
                           to_string(hair), report.motion_name);
  desc.y.title = "RMS position error over the length";
  desc.guides = {{"1 %", kChampionErrorLimit}};
  return front_plot(report, motion_points(report, hair, device), std::move(desc),
                    other_fronts(report, hair, device));
}

std::string analytic_plot(const WorkReport& report, const std::string& test, const std::string& title) {
  PlotDesc desc;
  desc.title = title;
  desc.y.title = "relative error";
  desc.height = 400.0;
  return front_plot(report, points_of(report, test, front_devices(report).front()), std::move(desc));
}

std::string work_precision_page(const WorkReport& report) {
  HtmlPage page("Strand models: error against run time");
  page.paragraph(
      fmt::format("{} runs on {}.{}", report.records.size(), executors_words(report),
                  report.is_quick ? " A quick report: fewer settings and a coarser reference." : ""));
  for (const MotionHair hair : report.grid.hairs) {
    page.heading(fmt::format("What to pick for {} hair", to_string(hair)));
    for (const std::string& device : front_devices(report)) {
      page.answer(hair_summary(report, hair, device));
      add_picks(page, report, hair, device);
      page.figure(
          motion_plot(report, hair, device),
          "Lines join the runs of a model that no other run of it beats; faint marks are all other runs; "
          "\"best on\" another executor joins those that no run of any model beats there. "
          "Rest the mouse on a mark for its setting.");
    }
    add_devices(page, report, hair);
  }
  page.heading("Where the error comes from");
  for (const MotionHair hair : report.grid.hairs) add_error_parts(page, report, hair);
  page.heading("Against exact solutions");
  add_analytic_tables(page, report);
  add_analytic_plot(page, report, "T1 Gamma 10", "T1: where the tip of a horizontal hair comes to rest");
  add_analytic_plot(page, report, "T4, T7", "T4: period of a hanging chain");
  add_droop_spread(page, report);
  add_method(page, report);
  return page.text();
}

Status save_work_precision(const WorkReport& report, const std::filesystem::path& folder) {
  RETURN_IF_ERROR(save_text(folder / kWorkPrecisionCsv, work_precision_csv(report)));
  const std::vector<std::string> devices = front_devices(report);
  for (const MotionHair hair : report.grid.hairs) {
    const std::string name = fmt::format("work_precision_{}", to_string(hair));
    if (devices.size() > 1) RETURN_IF_ERROR(save_text(folder / (name + ".svg"), devices_plot(report, hair)));
    for (const std::string& device : devices)
      RETURN_IF_ERROR(save_text(folder / (name + (device.empty() ? "" : "_" + device) + ".svg"),
                                motion_plot(report, hair, device)));
  }
  RETURN_IF_ERROR(save_text(folder / "cantilever.svg", analytic_plot(report, "T1 Gamma 10", "T1, Gamma 10")));
  RETURN_IF_ERROR(save_text(folder / "pendulum.svg", analytic_plot(report, "T4, T7", "T4: period")));
  return save_text(folder / kWorkPrecisionPage, work_precision_page(report));
}

}  // namespace strandcast

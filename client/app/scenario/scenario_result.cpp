#include "client/app/scenario/scenario_result.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "common/plot/svg_plot.h"

namespace strandcast {
namespace {

constexpr double kPlotWidth = 860.0;
constexpr double kPlotHeight = 240.0;

struct Panel {
  const char* title;
  double TraceSample::*value;
};
constexpr Panel kPanels[] = {{"largest stretch", &TraceSample::stretch},
                             {"simulated over real time", &TraceSample::realtime},
                             {"kbit/s", &TraceSample::kbit},
                             {"frames per second", &TraceSample::hz}};

std::string panel_svg(const ScenarioResult& result, const Panel& panel) {
  std::map<std::string, PlotSeries> series;
  for (const TraceSample& sample : result.trace) {
    if (sample.*panel.value < 0.0) continue;
    PlotSeries& one = series[sample.viewer];
    one.name = sample.viewer.empty() ? "server" : sample.viewer;
    one.mark = PlotMark::Line;
    one.points.push_back({sample.time_s, sample.*panel.value});
  }
  PlotDesc desc;
  desc.title = fmt::format("{}: {}", result.name, panel.title);
  desc.x = {"s", PlotScale::Linear};
  desc.y = {panel.title, PlotScale::Linear, 0.0};
  desc.width = kPlotWidth;
  desc.height = kPlotHeight;
  for (const WantedLimit& limit : result.wanted)
    if (limit.measure == panel.value) desc.guides.push_back({limit.name, limit.value});
  for (auto& [name, one] : series) desc.series.push_back(std::move(one));
  return make_svg_plot(desc);
}

std::string sentence_of(const CheckResult& check) {
  if (check.has_passed) return fmt::format("wanted {}, {}", check.wanted, check.measured);
  if (check.wanted.empty()) return check.measured;
  return fmt::format("{}, wanted {}{}{}", check.measured, check.wanted, check.detail.empty() ? "" : ", ",
                     check.detail);
}

}  // namespace

size_t ScenarioResult::failed_count() const {
  return static_cast<size_t>(std::count_if(checks.begin(), checks.end(),
                                           [](const CheckResult& check) { return !check.has_passed; }));
}

std::string to_line(const CheckResult& check) {
  return fmt::format("  {}  line {:<4} {}: {}", check.has_passed ? "ok  " : "FAIL", check.line, check.what,
                     sentence_of(check));
}

std::string to_junit(const std::vector<ScenarioResult>& results) {
  size_t tests = 0, failures = 0;
  std::string suites;
  for (const ScenarioResult& result : results) {
    tests += result.checks.size();
    failures += result.failed_count();
    suites +=
        fmt::format("  <testsuite name=\"{}\" tests=\"{}\" failures=\"{}\" errors=\"0\" time=\"{:.3f}\">\n",
                    html_escaped(result.name), result.checks.size(), result.failed_count(), result.seconds);
    for (const CheckResult& check : result.checks) {
      suites += fmt::format("    <testcase classname=\"{}\" name=\"line {}: {}\" time=\"{:.3f}\"",
                            html_escaped(result.name), check.line, html_escaped(check.what), check.seconds);
      const std::string sentence = html_escaped(sentence_of(check));
      suites += check.has_passed ? fmt::format("><system-out>{}</system-out></testcase>\n", sentence)
                                 : fmt::format("><failure message=\"{}\"/></testcase>\n", sentence);
    }
    suites += "  </testsuite>\n";
  }
  return fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites tests=\"{}\" failures=\"{}\">\n{}"
      "</testsuites>\n",
      tests, failures, suites);
}

std::string to_plot(const ScenarioResult& result) {
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:g} {1:g}\" width=\"{0:g}\" "
      "height=\"{1:g}\">\n",
      kPlotWidth, kPlotHeight * static_cast<double>(std::size(kPanels)));
  for (size_t i = 0; i < std::size(kPanels); ++i)
    svg += fmt::format("<g transform=\"translate(0 {:g})\">\n{}</g>\n", kPlotHeight * static_cast<double>(i),
                       panel_svg(result, kPanels[i]));
  return svg + "</svg>\n";
}

}  // namespace strandcast

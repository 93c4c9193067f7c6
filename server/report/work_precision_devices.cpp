#include "server/report/work_precision_devices.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "common/plot/svg_plot.h"
#include "server/report/work_precision_page.h"

namespace strandcast {
namespace {

double median_of(std::vector<double> sorted) {
  const size_t half = sorted.size() / 2;
  return sorted.size() % 2 == 1 ? sorted[half] : (sorted[half - 1] + sorted[half]) / 2.0;
}

std::string joined(const std::vector<std::string>& words) {
  return words.empty() ? "none" : fmt::format("{}", fmt::join(words, ", "));
}

/// Of all models together, which the shares of single ones weigh alike in.
double median_ratio(const std::vector<DeviceRatio>& ratios) {
  std::vector<double> medians;
  for (const DeviceRatio& ratio : ratios) medians.push_back(ratio.median);
  std::sort(medians.begin(), medians.end());
  return median_of(medians);
}

}  // namespace

std::vector<std::string> front_devices(const WorkReport& report) {
  if (report.executors.size() < 2) return {""};
  std::vector<std::string> devices;
  for (const ExecutorInfo& executor : report.executors) devices.emplace_back(to_string(executor.device));
  return devices;
}

bool is_of_device(const WorkRecord& record, const std::string& device) {
  return device.empty() || record.ran_on == device || record.ran_on == kRanInDouble;
}

std::string on_device(const std::string& device) {
  return device.empty() ? "" : " on " + device;
}

std::vector<std::string> front_methods(const std::vector<WorkPoint>& points) {
  std::vector<std::string> methods;
  for (const size_t i : pareto_front(points)) {
    if (std::find(methods.begin(), methods.end(), points[i].method) == methods.end())
      methods.push_back(points[i].method);
  }
  return methods;
}

std::vector<DeviceRatio> device_ratios(const WorkReport& report, MotionHair hair, const std::string& device,
                                       const std::string& base) {
  std::map<std::string, double> base_us;
  for (const WorkRecord& record : report.records)
    if (record.test == motion_test(hair) && record.ran_on == base)
      base_us[to_string(record.setting)] = record.us;
  std::vector<DeviceRatio> ratios;
  std::map<std::string, std::vector<double>> by_method;
  for (const WorkRecord& record : report.records) {
    if (record.test != motion_test(hair) || record.ran_on != device) continue;
    const auto other = base_us.find(to_string(record.setting));
    if (other == base_us.end() || !(record.us > 0.0) || !(other->second > 0.0)) continue;
    std::vector<double>& own = by_method[record.setting.row->name];
    if (own.empty()) ratios.push_back({record.setting.row->name});
    own.push_back(record.us / other->second);
  }
  for (DeviceRatio& ratio : ratios) {
    std::vector<double>& own = by_method[ratio.method];
    std::sort(own.begin(), own.end());
    ratio.settings = own.size();
    ratio.least = own.front();
    ratio.median = median_of(own);
    ratio.most = own.back();
  }
  return ratios;
}

std::string devices_summary(const WorkReport& report, MotionHair hair) {
  const std::vector<std::string> devices = front_devices(report);
  if (devices.size() < 2) return "";
  std::string text = fmt::format("On the front of {} hair, from fast to exact:", to_string(hair));
  for (const std::string& device : devices)
    text += fmt::format("{} {}{}", device == devices.front() ? "" : ";",
                        joined(front_methods(motion_points(report, hair, device))), on_device(device));
  text += ".";
  for (size_t i = 1; i < devices.size(); ++i) {
    const auto ratios = device_ratios(report, hair, devices[i], devices.front());
    if (!ratios.empty())
      text += fmt::format(" {} take {:.2g} times what {} takes, in the median of {} models.", devices[i],
                          median_ratio(ratios), devices.front(), ratios.size());
  }
  return text;
}

std::string devices_plot(const WorkReport& report, MotionHair hair) {
  PlotDesc desc;
  desc.title = fmt::format("The fronts of all models, {} hair, {}: below and left is better", to_string(hair),
                           report.motion_name);
  desc.x.title = kFrameTimeTitle;
  desc.y.title = "RMS position error over the length";
  std::vector<PlotSeries> fronts;
  int style = 0;
  for (const std::string& device : front_devices(report)) {
    const std::vector<WorkPoint> points = motion_points(report, hair, device);
    PlotSeries all{device, {}, PlotMark::Dots, style, true, false};
    PlotSeries front{device, {}, PlotMark::LineAndDots, style++};
    for (const WorkPoint& point : points)
      if (point.error < kWorstPlotted) all.points.push_back(plotted(point));
    for (const size_t i : pareto_front(points))
      if (points[i].error < kWorstPlotted) front.points.push_back(plotted(points[i]));
    desc.series.push_back(std::move(all));
    fronts.push_back(std::move(front));
  }
  desc.series.insert(desc.series.end(), fronts.begin(), fronts.end());
  return make_svg_plot(desc);
}

void add_devices(HtmlPage& page, const WorkReport& report, MotionHair hair) {
  const std::vector<std::string> devices = front_devices(report);
  if (devices.size() < 2) return;
  page.heading(fmt::format("{} beside each other, {} hair", joined(devices), to_string(hair)));
  page.answer(devices_summary(report, hair));
  page.figure(devices_plot(report, hair),
              "A line joins the runs that no other run on the same executor beats, whatever the model; faint "
              "marks are all other runs.");
  for (size_t i = 1; i < devices.size(); ++i) {
    HtmlTable table;
    table.caption =
        fmt::format("What the same settings take on {}, over what they take on {}. Below 1 is faster.",
                    devices[i], devices.front());
    table.columns = {"model", "settings", "least", "median", "most"};
    for (const DeviceRatio& ratio : device_ratios(report, hair, devices[i], devices.front()))
      table.rows.push_back({HtmlCell(ratio.method), HtmlCell(std::to_string(ratio.settings)),
                            HtmlCell(fmt::format("{:.2f}", ratio.least)),
                            HtmlCell(fmt::format("{:.2f}", ratio.median),
                                     ratio.median < 1.0 ? HtmlMark::Good : HtmlMark::None),
                            HtmlCell(fmt::format("{:.2f}", ratio.most))});
    page.table(table);
  }
}

}  // namespace strandcast

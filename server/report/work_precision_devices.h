// Comparison of executors in work-precision: their fronts side by side, the models on each, and the time that
// an executor saves. Pure functions of a WorkReport.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/report/html_page.h"
#include "server/report/pareto.h"
#include "server/report/work_precision.h"

namespace strandcast {

/// Returns the devices that have separate fronts ("gl", "lanes"); {""}, meaning all runs, with one executor
/// or none.
std::vector<std::string> front_devices(const WorkReport& report);
/// Returns whether a record belongs to the front of a device: it ran there, or it has no kernel and always
/// runs on the processor. "": every record does.
bool is_of_device(const WorkRecord& record, const std::string& device);
/// Returns " on lanes" and the like; empty for "".
std::string on_device(const std::string& device);

/// Returns the models with a run on the front, from the fastest to the most exact, each once.
std::vector<std::string> front_methods(const std::vector<WorkPoint>& points);

/// Time of a model's runs on one executor relative to the same settings on another.
struct DeviceRatio {
  std::string method;
  size_t settings = 0;
  double least = 0.0;
  double median = 0.0;
  double most = 0.0;
};
/// Returns the ratios for hair of the motion set; models are in the order of the records.
std::vector<DeviceRatio> device_ratios(const WorkReport& report, MotionHair hair, const std::string& device,
                                       const std::string& base);

/// Returns a sentence with the models on each front, and the time of later executors relative to the first;
/// "" with fewer than two.
std::string devices_summary(const WorkReport& report, MotionHair hair);
/// Returns a plot of every executor's front over all models as a line, with other runs faint.
std::string devices_plot(const WorkReport& report, MotionHair hair);
/// Adds plot, sentence and table; nothing with fewer than two executors.
void add_devices(HtmlPage& page, const WorkReport& report, MotionHair hair);

}  // namespace strandcast

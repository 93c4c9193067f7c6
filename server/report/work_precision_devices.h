// What work-precision says where it ran on several executors: their fronts beside each other, which models
// are on each, and what an executor saves. Pure functions of a WorkReport.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/report/html_page.h"
#include "server/report/pareto.h"
#include "server/report/work_precision.h"

namespace strandcast {

/// "gl", "lanes": what fronts are made of, each by itself; {""}, all runs, where there was one executor or
/// none.
std::vector<std::string> front_devices(const WorkReport& report);
/// The record belongs to the front of that device: it ran there, or has no kernel and takes the processor
/// whatever the executor. "": every record does.
bool is_of_device(const WorkRecord& record, const std::string& device);
/// " on lanes"; nothing for "".
std::string on_device(const std::string& device);

/// Models with a run on the front, from the fastest to the most exact, each once.
std::vector<std::string> front_methods(const std::vector<WorkPoint>& points);

/// What the runs of a model on one executor take over what the same settings take on another.
struct DeviceRatio {
  std::string method;
  size_t settings = 0;
  double least = 0.0;
  double median = 0.0;
  double most = 0.0;
};
/// Of the motion set's hair; models in the order of the records.
std::vector<DeviceRatio> device_ratios(const WorkReport& report, MotionHair hair, const std::string& device,
                                       const std::string& base);

/// Which models are on which front, and what the later executors take over the first, in a sentence; "" where
/// there are no two.
std::string devices_summary(const WorkReport& report, MotionHair hair);
/// Every executor's front over all models as a line; its other runs faint.
std::string devices_plot(const WorkReport& report, MotionHair hair);
/// Plot, sentence and table; nothing where there are no two.
void add_devices(HtmlPage& page, const WorkReport& report, MotionHair hair);

}  // namespace strandcast

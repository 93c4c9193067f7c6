// Files of work-precision: one CSV with every run, SVG plots, and one page with a recommendation. Pure
// functions of a WorkReport, except saving.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/plot/svg_plot.h"
#include "server/report/pareto.h"
#include "server/report/work_precision.h"

namespace strandcast {

inline constexpr const char* kWorkPrecisionPage = "work_precision.html";
inline constexpr const char* kWorkPrecisionCsv = "work_precision.csv";
inline constexpr const char* kChampion = "direct_rod";
inline constexpr double kChampionErrorLimit = 0.01;

inline constexpr const char* kFrameTimeTitle = "microseconds per strand and frame of 1/60 s";
/// Error above which a run no longer resembles the motion.
inline constexpr double kWorstPlotted = 3.0;
PlotPoint plotted(const WorkPoint& point);

/// Returns runs of the motion set as points of time and error, in the order of the records. They are those of
/// one executor (front_devices()); "" = of all.
std::vector<WorkPoint> motion_points(const WorkReport& report, MotionHair hair,
                                     const std::string& device = "");

/// Returns whether any model beats the champion, in a sentence for each kind of hair and executor. With
/// several executors, also what they save.
std::string work_precision_summary(const WorkReport& report);

std::string work_precision_csv(const WorkReport& report);
std::string work_precision_page(const WorkReport& report);

/// Returns a plot of error against time on the motion set. All runs are faint, each model's front is a line,
/// and so is the overall front on every other executor.
std::string motion_plot(const WorkReport& report, MotionHair hair, const std::string& device = "");
/// Returns a plot of error against time for one analytic test, on the first executor.
std::string analytic_plot(const WorkReport& report, const std::string& test, const std::string& title);

Status save_work_precision(const WorkReport& report, const std::filesystem::path& folder);

}  // namespace strandcast

// strandcast-report work-precision: measures error against run time of every strand model of the table. This
// header defines the measurements; work_precision_page.h writes them to files.
#pragma once

#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "server/report/analytic_tests.h"
#include "server/report/motion_set.h"
#include "server/report/run_timer.h"

namespace strandcast {

struct WorkPrecisionOptions {
  std::filesystem::path out;         // folder of the CSV, plots and page
  std::vector<std::string> solvers;  // rows of the table; empty = all
  std::filesystem::path motion;      // .bvh; empty: the built-in head motion
  MotionFileOptions motion_file;     // how to read it
  ExecutorConfig device;             // kNoDevice: every row as its reference; kAllDevices: on each executor
  bool is_quick = false;
  // Less than the whole grid; empty = all of it.
  std::vector<uint32_t> vertices;
  std::vector<double> rates_hz;    // multiples of 30
  std::vector<std::string> hairs;  // of the motion set, by name
  double motion_s = 0.0;           // of the motion set; 0 = as the grid says
};

/// The settings that are run.
struct WorkGrid {
  std::vector<uint32_t> vertices = {8, 16, 32, 64};
  std::vector<double> rates_hz = {30.0, 60.0, 120.0, 240.0};
  std::vector<double> effort_factors;  // times a row's default
  std::vector<uint32_t> substeps;
  // The tests with an exact answer; default effort only unless has_every_effort.
  std::vector<uint32_t> analytic_vertices;
  std::vector<double> analytic_rates_hz;
  bool has_every_effort = false;  // also for float against double
  double motion_s = 3.0;
  uint32_t strand_count = 8;
  std::vector<MotionHair> hairs{std::begin(kMotionHairs), std::end(kMotionHairs)};
  // The converged rod, the other model that it is checked with, and each row's own refined version, all in
  // double.
  uint32_t reference_vertices = 128;
  double reference_rate_hz = 7680.0;
  double check_rate_hz = 3840.0;
  uint32_t refined_vertices = 64;
  double refined_rate_hz = 3840.0;
  double refined_effort_factor = 1.0;
  // A row without a kernel may be so slow that its runs take minutes: those beyond this are left out,
  // and refined versions take longer steps to keep it.
  double longest_run_s = 120.0;
};
WorkGrid make_work_grid(const WorkPrecisionOptions& options);

/// Result of one run; NaN = not measured.
struct WorkRecord {
  std::string test;  // motion_test() or the name of an analytic one
  RunSetting setting;
  std::string ran_on;                                    // Workbench::name_of()
  double us = std::numeric_limits<double>::quiet_NaN();  // per strand and frame, best of several
  double median_us = std::numeric_limits<double>::quiet_NaN();
  // Of the motion set, all relative RMS position errors: the row refined against the rod, the run against the
  // row refined, the kernel's run against double precision at the same setting.
  double model_error = std::numeric_limits<double>::quiet_NaN();
  double discretisation_error = std::numeric_limits<double>::quiet_NaN();
  double float_error = std::numeric_limits<double>::quiet_NaN();
  double refined_rate_hz = std::numeric_limits<double>::quiet_NaN();
  AnalyticResult result = {};  // of the motion set: error, stretch and note
};
/// Returns the name of a motion test: "motion, curled hair".
std::string motion_test(MotionHair hair);
/// Name of a model, other than the rod, that has all of its physics.
inline constexpr const char* kCheckModel = "articulated";

/// Adds the time of the record's setting: that of a frame at its rate and substeps.
void add_time(WorkRecord& record, const StrandTime& time);

struct WorkReport {
  WorkGrid grid;
  bool is_quick = false;
  std::vector<ExecutorInfo> executors;  // empty: every row ran as its double-precision reference
  std::string motion_name;
  uint32_t timed_strands = 0;  // on the first of the executors
  /// Distance of the converged rod from other converged solutions, relative RMS.
  struct Converged {
    MotionHair hair = MotionHair::Straight;
    double time_self_difference = 0.0;   // itself with steps of half the length
    double space_self_difference = 0.0;  // itself with half as many vertices
    double check_difference = 0.0;       // kCheckModel with as many vertices at check_rate_hz
  };
  std::vector<Converged> converged;
  std::vector<WorkRecord> records;
};

/// Runs everything and prints progress. BadInput for options that leave nothing to run.
Result<WorkReport> measure_work_precision(const WorkPrecisionOptions& options);

/// Measures, writes the files, and prints progress and their location.
Status run_work_precision(const WorkPrecisionOptions& options);

}  // namespace strandcast

// strandcast-report work-precision: error against run time of every strand model of the table.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace strandcast {

struct WorkPrecisionOptions {
  std::filesystem::path out;         // folder of the CSV, plots and page
  std::vector<std::string> solvers;  // rows of the table; empty = all
  std::filesystem::path motion;      // .bvh; empty: the built-in head motion
  std::string gl_device = "auto";
  bool is_quick = false;
};

/// Measures and writes; prints progress and where the files are.
Status run_work_precision(const WorkPrecisionOptions& options);

}  // namespace strandcast

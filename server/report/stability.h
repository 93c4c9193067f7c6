// strandcast-report stability: tests every strand model of the table with stiff and extreme cases.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server/report/stability_run.h"

namespace strandcast {

struct StabilityOptions {
  std::filesystem::path out;         // folder of the CSV and the page
  std::vector<std::string> solvers;  // rows of the table; empty = all
  ExecutorConfig device;
  bool is_quick = false;
};

/// Measures, prints the tables and writes them.
Status run_stability(const StabilityOptions& options);

/// Set-up of the outcomes; `device` is what the runs ran on.
struct StabilitySetup {
  std::string device;
  StabilityGrid grid = StabilityGrid::Full;
};

/// Return the tables as printed text, as CSV and as a page.
std::string stability_text(const std::vector<StabilityOutcome>& outcomes);
std::string stability_csv(const std::vector<StabilityOutcome>& outcomes);
std::string stability_page(const std::vector<StabilityOutcome>& outcomes, const StabilitySetup& setup);

}  // namespace strandcast

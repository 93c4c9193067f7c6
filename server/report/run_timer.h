// RunTimer: measures the time of one substep of a strand model per strand, with many strands at once, so that
// dispatch overhead does not dominate. Runs on its executor's thread.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <tuple>

#include "common/base/profile.h"
#include "server/report/motion_set.h"

namespace strandcast {

struct StrandTime {
  double best_us = 0.0;  // per strand and substep; the least disturbed of several
  double median_us = 0.0;
};

/// Returns microseconds per strand and frame (MotionSet::kFrameS) at the setting's rate and substeps.
double us_per_frame(double us_per_substep, const RunSetting& setting);

class RunTimer {
 public:
  /// Makes a timer; `clock_ns` times work that does not run on a device of its own.
  RunTimer(const Workbench& workbench, const MotionSet& motion, std::function<int64_t()> clock_ns = now_ns)
      : workbench_(workbench), motion_(motion), clock_ns_(std::move(clock_ns)) {}

  /// Returns the time; measured once per row, vertex count and effort, because rate and substeps do not
  /// affect it.
  Result<StrandTime> time(const RunSetting& setting);

  /// Returns the number of strands in one measurement.
  uint32_t strand_count(const RunSetting& setting) const;

 private:
  double substep_ms(StrandRun& run, const StepInput& input) const;
  Result<StrandTime> measure(const RunSetting& setting) const;

  const Workbench& workbench_;
  const MotionSet& motion_;
  std::function<int64_t()> clock_ns_;
  std::map<std::tuple<std::string, uint32_t, double>, StrandTime> measured_;
};

}  // namespace strandcast

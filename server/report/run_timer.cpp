#include "server/report/run_timer.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/base/units.h"

namespace strandcast {
namespace {

// Enough to fill every lane and thread; hardware needs far more of them at once.
constexpr uint32_t kSoftwareStrands = 1'024;
constexpr uint32_t kHardwareStrands = 16'384;
constexpr uint32_t kReferenceStrands = 2;  // nothing to share between them
constexpr int kWarmUpSubsteps = 3;
constexpr int kTimedSubsteps = 8;

}  // namespace

double us_per_frame(double us_per_substep, const RunSetting& setting) {
  return us_per_substep * setting.substeps * setting.rate_hz * MotionSet::kFrameS;
}

uint32_t RunTimer::strand_count(const RunSetting& setting) const {
  if (!workbench_.runs_kernel(setting)) return kReferenceStrands;
  return workbench_.executor->info().is_software ? kSoftwareStrands : kHardwareStrands;
}

Result<StrandTime> RunTimer::time(const RunSetting& setting) {
  const double effort = std::isnan(setting.effort) ? 0.0 : setting.effort;
  const std::tuple key(setting.row->name, setting.vertex_count, effort);
  if (const auto known = measured_.find(key); known != measured_.end()) return known->second;
  ASSIGN_OR_RETURN(const StrandTime time, measure(setting));
  measured_[key] = time;
  return time;
}

double RunTimer::substep_ms(StrandRun& run, const StepInput& input) const {
  if (workbench_.runs_kernel(run.setting()))
    return timed_ms(*workbench_.executor, [&] { run.substep(input); });
  const int64_t begin_ns = clock_ns_();
  run.substep(input);
  return static_cast<double>(clock_ns_() - begin_ns) * kMsPerNs;
}

Result<StrandTime> RunTimer::measure(const RunSetting& setting) const {
  const uint32_t strands = strand_count(setting);
  ASSIGN_OR_RETURN(StrandRun run, StrandRun::make(workbench_, setting, motion_.physics(),
                                                  motion_.groom(setting.vertex_count, strands)));
  std::vector<double> sample_us;
  int count = 0;
  for (const StepInput& input : motion_.inputs(setting, kWarmUpSubsteps + kTimedSubsteps)) {
    const double ms = substep_ms(run, input);
    if (++count > kWarmUpSubsteps) sample_us.push_back(ms * kUsPerMs / strands);
  }
  std::sort(sample_us.begin(), sample_us.end());
  return StrandTime{sample_us.front(), sample_us[sample_us.size() / 2]};
}

}  // namespace strandcast

#include "server/scene/input_clock.h"

#include <algorithm>
#include <cmath>

#include "common/base/units.h"

namespace strandcast {
InputClock::InputClock(double step_s) : step_ns_(step_s * kNsPerS) {}

int64_t InputClock::next(int64_t due_ns) {
  const double passed_ns = last_due_ns_ ? static_cast<double>(due_ns - *last_due_ns_) : step_ns_;
  const double before_ns = last_due_ns_ ? behind_ns_ : 0.0;
  last_due_ns_ = due_ns;
  // One step on, and then a part of what is missing.
  const double missing_ns = before_ns + passed_ns - step_ns_;
  const bool leaps = missing_ns > static_cast<double>(kLongestBehindNs);
  behind_ns_ = leaps ? 0.0 : missing_ns * (1.0 - kCatchUpShare);
  const bool is_on_time = behind_ns_ < static_cast<double>(kOnTimeNs);
  if (is_on_time) behind_ns_ = 0.0;
  rate_ = is_on_time && !leaps ? 1.0 : std::max(1.0, (passed_ns + before_ns - behind_ns_) / step_ns_);
  return due_ns - static_cast<int64_t>(std::llround(behind_ns_));
}

}  // namespace strandcast

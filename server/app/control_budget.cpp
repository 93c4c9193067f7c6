#include "server/app/control_budget.h"

#include <algorithm>

#include "common/base/units.h"

namespace strandcast {

bool ControlBudget::take(SessionId session, int64_t time_ns) {
  Bucket& bucket = buckets_.try_emplace(session, Bucket{kControlBurst, time_ns}).first->second;
  const double passed_s = static_cast<double>(time_ns - bucket.time_ns) * kSPerNs;
  bucket.left = std::min(kControlBurst, bucket.left + passed_s * kControlsPerS);
  bucket.time_ns = time_ns;
  if (bucket.left < 1.0) return false;
  bucket.left -= 1.0;
  return true;
}

}  // namespace strandcast

// ControlBudget: how many commands and changes each controller may send. What they cost the simulation is
// bounded there (SimLoop). Plain logic on given times; network thread.
#pragma once

#include <cstdint>
#include <map>

#include "server/net/net_config.h"

namespace strandcast {

/// Commands and changes of one controller: so many a second,
inline constexpr double kControlsPerS = 60.0;
/// and so many at once, after a time of quiet.
inline constexpr double kControlBurst = 120.0;

class ControlBudget {
 public:
  /// False when this one is too many.
  bool take(SessionId session, int64_t time_ns);
  void remove(SessionId session) { buckets_.erase(session); }

 private:
  struct Bucket {
    double left = kControlBurst;
    int64_t time_ns = 0;
  };
  std::map<SessionId, Bucket> buckets_;
};

}  // namespace strandcast

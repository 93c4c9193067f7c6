// ControlBudget: limits how many commands and changes each controller may send. SimLoop bounds their cost for
// the simulation. Plain logic on given times; network thread.
#pragma once

#include <cstdint>
#include <map>

#include "server/net/net_config.h"

namespace strandcast {

/// Sustained number of commands and changes per second of one controller.
inline constexpr double kControlsPerS = 60.0;
/// Number of commands and changes that a controller may send at once after a quiet time.
inline constexpr double kControlBurst = 120.0;

class ControlBudget {
 public:
  /// Counts one command or change; returns false if it exceeds the limit.
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

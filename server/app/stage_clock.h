// StageClock: what a stage tells the time by: this machine's clock in local time, UTC or TAI, or a PTP
// device.
#pragma once

#include <cstdint>
#include <ctime>
#include <memory>
#include <string>

#include "common/base/result.h"
#include "common/base/timecode.h"

namespace strandcast {

class StageClock {
 public:
  /// Makes local time.
  StageClock() = default;
  /// Opens "local", "utc", "tai" or the path of a PTP device. BadInput or NotFound says what is missing.
  static Result<StageClock> open(const std::string& text);

  const std::string& name() const { return name_; }
  /// Returns the time since 1970, ns, as the clock counts; local time counts like UTC. Any thread.
  int64_t time_ns() const;
  /// Returns the timecode of now, counted like `count`. Any thread.
  Timecode timecode(const Timecode& count) const { return timecode_at(time_ns(), count); }
  /// Returns the timecode of a time_ns(): of its time of day.
  Timecode timecode_at(int64_t time_ns, const Timecode& count) const;

 private:
  std::string name_ = "local";
  clockid_t id_ = CLOCK_REALTIME;
  bool is_local_ = true;
  std::shared_ptr<void> device_;  // that is kept open
};

}  // namespace strandcast

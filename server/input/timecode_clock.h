// TimecodeClock: tells the timecode at any time of the server's clock, from timecodes as they arrive: late,
// and by a clock that drifts. Pure arithmetic; not thread-safe.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>

#include "common/base/timecode.h"
#include "common/base/units.h"
#include "common/wire/messages.h"
#include "server/input/clock_map.h"

namespace strandcast {

/// A timecode that is further from where it was expected is a jump: nothing before it counts.
inline constexpr double kTimecodeJumpS = 0.25;
/// A clock that was silent for so long tells nothing any more.
inline constexpr int64_t kTimecodeStaleNs = 3'000'000'000;

/// Returns the timecode `passed_ns` later.
inline Timecode later(const Timecode& timecode, int64_t passed_ns) {
  return advanced(timecode, static_cast<double>(passed_ns) * kSPerNs * timecode.rate.hz());
}

/// Returns the timecode of one of these samples.
inline std::optional<Timecode> timecode_of(const MotionSamples& samples,
                                           const MotionSamples::Sample& sample) {
  if (!samples.timecode) return std::nullopt;
  return later(*samples.timecode, sample.time_ns - samples.samples.front().time_ns);
}

class TimecodeClock {
 public:
  /// Takes a timecode of now; `arrival_ns` must not decrease.
  void add(const Timecode& timecode, int64_t arrival_ns) {
    const std::optional<Timecode> expected = at(arrival_ns);
    const bool goes_on = expected && is_same_count(*expected, timecode) &&
                         std::abs(frames_between(*expected, timecode)) <= kTimecodeJumpS * timecode.rate.hz();
    if (!goes_on) {
      clock_ = {};
      place_s_ = 0.0;
    } else {
      place_s_ += frames_between(*newest_, timecode) / timecode.rate.hz();
    }
    newest_ = timecode;
    newest_ns_ = arrival_ns;
    clock_.add(std::llround(place_s_ * kNsPerS), arrival_ns);
  }

  /// Returns the timecode at a time of the server's clock; empty if none came for kTimecodeStaleNs.
  std::optional<Timecode> at(int64_t time_ns) const {
    if (!newest_ || time_ns - newest_ns_ > kTimecodeStaleNs) return std::nullopt;
    const double passed_s = static_cast<double>(clock_.to_source_ns(time_ns)) * kSPerNs - place_s_;
    return advanced(*newest_, passed_s * newest_->rate.hz());
  }

 private:
  ClockMap clock_;
  std::optional<Timecode> newest_;
  int64_t newest_ns_ = 0;  // its arrival
  double place_s_ = 0.0;   // of it behind the first one
};

}  // namespace strandcast

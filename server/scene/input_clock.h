// InputClock: chooses the input time that each simulation step uses. In real time it is the time that the
// step represents. If steps are dropped, it advances smoothly, faster than the simulation, so that the head
// does not leap. Pure logic: times are passed in.
#pragma once

#include <cstdint>
#include <optional>

namespace strandcast {

/// Share of the remaining lag that each step removes: half of a sudden lag is gone after five steps. At a
/// lasting speed f of the simulation the inputs lag by (1 / f - 1) * (1 / kCatchUpShare - 1) steps.
inline constexpr double kCatchUpShare = 0.125;
/// Lag beyond which the inputs leap to the present; it was a stop, and nobody wants to see what was missed.
inline constexpr int64_t kLongestBehindNs = 1'000'000'000;
/// Lag below which the inputs count as up to date.
inline constexpr int64_t kOnTimeNs = 10'000;

class InputClock {
 public:
  explicit InputClock(double step_s);

  /// Returns the input time at the end of the next step, which represents server time `due_ns`. Never later
  /// than that, and equal to it while no step was dropped.
  int64_t next(int64_t due_ns);
  /// Makes the next step count as the first, so that nothing is caught up.
  void restart() { last_due_ns_.reset(); }

  /// Returns input time per simulated time in the newest step; 1 in real time, never less.
  double rate() const { return rate_; }

 private:
  const double step_ns_;
  std::optional<int64_t> last_due_ns_;
  double behind_ns_ = 0.0;  // of the newest step against its due time
  double rate_ = 1.0;
};

}  // namespace strandcast

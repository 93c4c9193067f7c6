// InputClock: up to which time of the input streams each simulation step goes. In real time that is the time
// the step stands for. When steps are left out it goes on smoothly, faster than the simulation, so that the
// head does not leap whenever a step is missing. Pure logic: times are passed in.
#pragma once

#include <cstdint>
#include <optional>

namespace strandcast {

/// Behind by a sudden stop, the inputs are this share of it closer with every step: half of it after five.
/// At a lasting pace f of the simulation they stay (1 / f - 1) * (1 / kCatchUpShare - 1) steps behind.
inline constexpr double kCatchUpShare = 0.125;
/// Further behind than this the inputs leap: it was a stop, and nobody wants to see what was missed.
inline constexpr int64_t kLongestBehindNs = 1'000'000'000;
/// Closer than this is not behind.
inline constexpr int64_t kOnTimeNs = 10'000;

class InputClock {
 public:
  explicit InputClock(double step_s);

  /// The time of the inputs at the end of the next step, which stands for `due_ns` of server time. Never
  /// later than that, and exactly that while no step was left out.
  int64_t next(int64_t due_ns);
  /// The next step follows none: nothing was missed.
  void restart() { last_due_ns_.reset(); }

  /// Time of the inputs that passed in the newest step per simulated time; 1 in real time, never less.
  double rate() const { return rate_; }

 private:
  const double step_ns_;
  std::optional<int64_t> last_due_ns_;
  double behind_ns_ = 0.0;  // of the newest step against its due time
  double rate_ = 1.0;
};

}  // namespace strandcast

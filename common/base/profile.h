// StageTimer keeps the last kStageWindow durations of one stage and returns their median and p99. Not
// thread-safe: each timer belongs to one thread, which copies values out.
#pragma once

#include <chrono>
#include <cstdint>
#include <vector>

namespace strandcast {

inline constexpr int kStageWindow = 512;

/// Returns the monotonic clock in nanoseconds (CLOCK_MONOTONIC), comparable between processes of one machine.
inline int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

class StageTimer {
 public:
  /// Adds one duration in milliseconds.
  void add_ms(double value_ms);
  uint64_t count() const { return count_; }
  /// Returns the quantile (0..1) over the window in milliseconds; 0 if it is empty.
  double quantile_ms(double quantile) const;
  double median_ms() const { return quantile_ms(0.5); }

 private:
  std::vector<double> window_ms_;
  uint64_t count_ = 0;
};

/// Adds the time between construction and destruction to a StageTimer.
class ScopedStage {
 public:
  explicit ScopedStage(StageTimer& timer) : timer_(timer), begin_ns_(now_ns()) {}
  ~ScopedStage() { timer_.add_ms(static_cast<double>(now_ns() - begin_ns_) * 1e-6); }
  ScopedStage(const ScopedStage&) = delete;
  ScopedStage& operator=(const ScopedStage&) = delete;

 private:
  StageTimer& timer_;
  int64_t begin_ns_;
};

}  // namespace strandcast

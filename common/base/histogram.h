// Histogram: counts durations by length since start. A value; not thread-safe, copied out by its owner.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace strandcast {

class Histogram {
 public:
  /// Upper ends of the buckets in milliseconds, inclusive. One further bucket counts longer durations.
  static constexpr std::array<double, 12> kBoundsMs = {0.5, 1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1'024};

  /// Counts one duration in milliseconds; it must be finite.
  void add_ms(double value_ms) {
    const auto bucket = std::lower_bound(kBoundsMs.begin(), kBoundsMs.end(), value_ms);
    ++counts_[static_cast<size_t>(bucket - kBoundsMs.begin())];
    sum_ms_ += value_ms;
  }
  /// Number of durations in this bucket alone (not cumulative); index kBoundsMs.size() is the last bucket.
  uint64_t count(size_t bucket) const { return counts_[bucket]; }
  double sum_ms() const { return sum_ms_; }

 private:
  std::array<uint64_t, kBoundsMs.size() + 1> counts_{};
  double sum_ms_ = 0.0;
};

}  // namespace strandcast

// ClockMap: maps one source's clock to the server's, from one-way traffic. Pure arithmetic; not thread-safe.
#pragma once

#include <array>
#include <cstdint>

#include "common/base/units.h"

namespace strandcast {
inline constexpr int64_t kClockWindowS = 10;

/// Estimates the offset from the fastest sample within the last kClockWindowS. Arrival minus sample time is
/// clock offset plus delay, of which only the delay varies. Its minimum removes jitter and retains the
/// smallest delay, so no sample maps to a time after its arrival. The window follows slow clock drift.
class ClockMap {
 public:
  /// Adds a sample; `arrival_ns` must not decrease.
  void add(int64_t sample_ns, int64_t arrival_ns) {
    const int64_t second = arrival_ns / kSInNs;
    Bucket& bucket =
        buckets_[static_cast<size_t>(((second % kClockWindowS) + kClockWindowS) % kClockWindowS)];
    const int64_t difference_ns = arrival_ns - sample_ns;
    if (!bucket.is_used || bucket.second != second || difference_ns < bucket.smallest_ns)
      bucket = {true, second, difference_ns};
    offset_ns_ = difference_ns;
    for (const Bucket& other : buckets_)
      if (other.is_used && second - other.second < kClockWindowS && other.smallest_ns < offset_ns_)
        offset_ns_ = other.smallest_ns;
  }
  /// Returns server clock minus source clock, ns.
  int64_t offset_ns() const { return offset_ns_; }
  int64_t to_source_ns(int64_t server_ns) const { return server_ns - offset_ns_; }

 private:
  struct Bucket {
    bool is_used = false;
    int64_t second = 0;
    int64_t smallest_ns = 0;
  };
  std::array<Bucket, kClockWindowS> buckets_{};
  int64_t offset_ns_ = 0;
};

}  // namespace strandcast

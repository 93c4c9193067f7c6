// SampleTrack: bounded buffer of one stream's timed samples, in time order. Not thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>

namespace strandcast {

inline constexpr size_t kMaxBufferedSamples = 1024;

template <class Value>
struct TimedSample {
  int64_t time_ns = 0;     // source clock
  int64_t arrival_ns = 0;  // server clock
  Value value{};
};

enum class InsertOutcome { Accepted, Late, Duplicate };

template <class Value>
class SampleTrack {
 public:
  using Sample = TimedSample<Value>;

  /// Inserts a sample in time order. Late: not newer than the newest sample already used. At most
  /// kMaxBufferedSamples are kept; the oldest is dropped first.
  InsertOutcome insert(const Sample& sample) {
    if (sample.time_ns <= newest_used_ns_)
      return sample.time_ns == newest_used_ns_ ? InsertOutcome::Duplicate : InsertOutcome::Late;
    size_t place = samples_.size();
    while (place > 0 && samples_[place - 1].time_ns >= sample.time_ns) {
      if (samples_[place - 1].time_ns == sample.time_ns) return InsertOutcome::Duplicate;
      --place;
    }
    samples_.insert(samples_.begin() + static_cast<std::ptrdiff_t>(place), sample);
    if (samples_.size() > kMaxBufferedSamples) {
      samples_.pop_front();
      ++dropped_;
    }
    return InsertOutcome::Accepted;
  }

  /// Returns the index of the last sample at or before `time_ns`, or 0 if all are later. The track must not
  /// be empty.
  size_t index_at(int64_t time_ns) const {
    size_t index = samples_.size() - 1;
    while (index > 0 && samples_[index].time_ns > time_ns) --index;
    return index;
  }

  /// Marks everything up to index `newest` as used and drops what is older than index `oldest`.
  void use(size_t oldest, size_t newest) {
    if (samples_[newest].time_ns > newest_used_ns_) newest_used_ns_ = samples_[newest].time_ns;
    samples_.erase(samples_.begin(), samples_.begin() + static_cast<std::ptrdiff_t>(oldest));
  }

  void clear() {
    samples_.clear();
    newest_used_ns_ = std::numeric_limits<int64_t>::min();
  }

  const std::deque<Sample>& samples() const { return samples_; }
  uint64_t dropped() const { return dropped_; }

 private:
  std::deque<Sample> samples_;
  int64_t newest_used_ns_ = std::numeric_limits<int64_t>::min();
  uint64_t dropped_ = 0;
};

}  // namespace strandcast

// LineBudget: limits how many lines a server can make a program print. Pure logic on given times, one thread.
#pragma once

#include <array>
#include <cstdint>
#include <utility>

#include "common/base/units.h"

namespace strandcast {

inline constexpr uint32_t kMaxForeignLinesPerS = 20;

class LineBudget {
 public:
  /// Returns whether a line may be written at `time_ns`, which must not decrease. No interval of one second
  /// has more lines than the limit.
  bool take(int64_t time_ns) {
    int64_t& oldest_ns = written_ns_[count_ % kMaxForeignLinesPerS];
    if (count_ >= kMaxForeignLinesPerS && time_ns - oldest_ns < kSInNs) {
      ++left_out_;
      return false;
    }
    oldest_ns = time_ns;
    ++count_;
    return true;
  }
  /// Returns the number of suppressed lines since the last call.
  uint64_t take_left_out() { return std::exchange(left_out_, 0); }

 private:
  std::array<int64_t, kMaxForeignLinesPerS>
      written_ns_{};    // when the last lines were, the next place is the oldest
  uint64_t count_ = 0;  // of lines written
  uint64_t left_out_ = 0;
};

}  // namespace strandcast

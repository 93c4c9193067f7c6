// LineBudget: how many lines a server may make a program write. Pure logic on given times, one thread.
#pragma once

#include <cstdint>
#include <utility>

namespace strandcast {

inline constexpr uint32_t kMaxForeignLinesPerS = 20;

class LineBudget {
 public:
  /// Whether a line may be written at `time_ns`, which does not run backwards: as many in any second as the
  /// limit, at once or spread.
  bool take(int64_t time_ns) {
    constexpr int64_t kSecondNs = 1'000'000'000;
    if (!is_started_ || time_ns - second_ns_ >= kSecondNs) {
      is_started_ = true;
      second_ns_ = time_ns;
      taken_ = 0;
    }
    if (taken_ < kMaxForeignLinesPerS) {
      ++taken_;
      return true;
    }
    ++left_out_;
    return false;
  }
  /// Lines that were not written since the last call.
  uint64_t take_left_out() { return std::exchange(left_out_, 0); }

 private:
  bool is_started_ = false;
  int64_t second_ns_ = 0;  // when the present second began
  uint32_t taken_ = 0;     // in it
  uint64_t left_out_ = 0;
};

}  // namespace strandcast

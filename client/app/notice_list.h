// Bounds of what a server makes a program keep (NoticeList) and print (LineBudget). One thread.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <iterator>
#include <utility>
#include <vector>

#include "common/base/units.h"
#include "common/wire/messages.h"

namespace strandcast {

inline constexpr size_t kMaxWaitingNotices = 64;

/// The server's notices until a person reads them; the oldest are dropped.
class NoticeList {
 public:
  void add(Notice notice) {
    notices_.push_back(std::move(notice));
    if (notices_.size() > kMaxWaitingNotices) notices_.pop_front();
  }
  /// Returns and removes all notices, oldest first.
  std::vector<Notice> take() {
    std::vector<Notice> taken(std::make_move_iterator(notices_.begin()),
                              std::make_move_iterator(notices_.end()));
    notices_.clear();
    return taken;
  }

 private:
  std::deque<Notice> notices_;
};

inline constexpr uint32_t kMaxForeignLinesPerS = 20;

/// Limits how many lines a server can make a program print, on given times.
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

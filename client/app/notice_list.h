// NoticeList: the server's notices until a person reads them. Bounded; the oldest are dropped. One thread.
#pragma once

#include <deque>
#include <iterator>
#include <utility>
#include <vector>

#include "common/wire/messages.h"

namespace strandcast {

inline constexpr size_t kMaxWaitingNotices = 64;

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

}  // namespace strandcast

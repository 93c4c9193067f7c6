// JoinedAnswers: one answer to a command that several heads carry out. Any thread.
#pragma once

#include <cstddef>
#include <mutex>
#include <string>
#include <vector>

#include "server/stream/state_source.h"

namespace strandcast {

class JoinedAnswers {
 public:
  /// Replies once, when each of the heads has answered.
  JoinedAnswers(std::vector<std::string> heads, StateSource::Reply reply);

  /// Takes the answer of the head at `index`.
  void take(size_t index, Notice notice);

 private:
  Notice joined() const;

  const StateSource::Reply reply_;
  const std::vector<std::string> heads_;
  std::mutex mutex_;  // guards the two below; once none is open nobody writes
  std::vector<Notice> notices_;
  size_t open_;
};

}  // namespace strandcast

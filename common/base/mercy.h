// What readers of files do with items that they cannot use: leave them out or bridge them, count them, and
// refuse the file when too little is left. Any thread.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/result.h"

namespace strandcast {

/// A file is refused when more than one in this number of its items is bad.
inline constexpr uint64_t kMostBadShare = 10;

/// Returns "1 guide is" or "3 guides are", of which the two are given.
inline std::string counted(uint64_t count, const char* one, const char* many) {
  return fmt::format("{} {}", count, count == 1 ? one : many);
}

class BadItems {
 public:
  /// Counts `count` items, 1 or more, of which `problem` says what is wrong with the first.
  void add(Error problem, uint64_t count = 1) {
    if (count_ == 0) first_ = std::move(problem);
    count_ += count;
  }
  uint64_t count() const { return count_; }
  /// Returns the first of them; count() is not 0.
  const Error& first() const { return *first_; }
  /// Returns the first one's error where more than a tenth of `total` items is bad, or none is good.
  Status judge(uint64_t total, const char* items) const {
    if (count_ == 0 || (count_ < total && count_ * kMostBadShare <= total)) return {};
    return Error(first_->code,
                 fmt::format("{}; {} of {} {} cannot be used, a tenth at most may be so", first_->message,
                             count_, total, items),
                 first_->place);
  }
  /// Returns "3 of 40 frames cannot be used, WHAT; the first: PLACE: WHY".
  std::string sentence(uint64_t total, const char* items, const char* what) const {
    return fmt::format("{} of {} {} cannot be used, {}; the first: {}", count_, total, items, what,
                       first_->to_string());
  }
  /// Judges, and adds the sentence to `notes` if there is anything to say.
  Status settle(uint64_t total, const char* items, const char* what, std::vector<std::string>& notes) const {
    RETURN_IF_ERROR(judge(total, items));
    if (count_ > 0) notes.push_back(sentence(total, items, what));
    return {};
  }

 private:
  uint64_t count_ = 0;
  std::optional<Error> first_;
};

}  // namespace strandcast

#include "server/app/joined_answers.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace strandcast {

JoinedAnswers::JoinedAnswers(std::vector<std::string> heads, StateSource::Reply reply)
    : reply_(std::move(reply)), heads_(std::move(heads)), notices_(heads_.size()), open_(heads_.size()) {}

void JoinedAnswers::take(size_t index, Notice notice) {
  {
    const std::lock_guard lock(mutex_);
    notices_[index] = std::move(notice);
    if (--open_ > 0) return;
  }
  reply_(joined());
}

/// What all say alike stands once, as the first says it; of others each text stands, an error with its head.
Notice JoinedAnswers::joined() const {
  const Notice& first = notices_.front();
  const bool is_same = std::all_of(notices_.begin(), notices_.end(), [&](const Notice& one) {
    return one.is_error == first.is_error && one.text == first.text;
  });
  if (is_same) return first;
  Notice all = first;
  all.text.clear();
  for (size_t i = 0; i < notices_.size(); ++i) {
    all.is_error = all.is_error || notices_[i].is_error;
    all.text += fmt::format("{}{}{}", i > 0 ? " " : "", notices_[i].is_error ? heads_[i] + ": " : "",
                            notices_[i].text);
  }
  return all;
}

}  // namespace strandcast

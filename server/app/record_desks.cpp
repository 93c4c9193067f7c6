#include "server/app/record_desks.h"

#include <algorithm>
#include <memory>
#include <mutex>
#include <utility>

namespace strandcast {
namespace {

/// What each of several desks answers, until the last one has.
class Answers {
 public:
  Answers(std::vector<std::string> heads, RecordDesk::Reply reply)
      : reply_(std::move(reply)), heads_(std::move(heads)), notices_(heads_.size()), open_(heads_.size()) {}

  void take(size_t index, Notice notice) {
    {
      const std::lock_guard lock(mutex_);
      notices_[index] = std::move(notice);
      if (--open_ > 0) return;
    }
    reply_(joined());
  }

 private:
  /// Joins the heads' notices: an error that all share stands once, any other with its head's name.
  Notice joined() const {
    const bool is_same = std::all_of(notices_.begin(), notices_.end(), [this](const Notice& one) {
      return one.is_error && one.text == notices_.front().text;
    });
    if (is_same) return notices_.front();
    Notice all{false, {}};
    for (size_t i = 0; i < notices_.size(); ++i) {
      all.is_error = all.is_error || notices_[i].is_error;
      all.text += fmt::format("{}{}{}", i > 0 ? " " : "", notices_[i].is_error ? heads_[i] + ": " : "",
                              notices_[i].text);
    }
    return all;
  }

  const RecordDesk::Reply reply_;
  const std::vector<std::string> heads_;
  std::mutex mutex_;  // guards the two below; once none is open nobody writes
  std::vector<Notice> notices_;
  size_t open_;
};

}  // namespace

void RecordDesks::obey(const RecordCommand& command, const RecordDesk::Reply& reply) const {
  std::vector<Of> asked = all_;
  if (!command.is_wanted) std::erase_if(asked, [](const Of& one) { return one.desk->text().empty(); });
  if (asked.empty()) return all_.front().desk->obey(command, reply);
  std::vector<std::string> heads;
  for (const Of& one : asked) heads.push_back(one.head);
  const auto answers = std::make_shared<Answers>(std::move(heads), reply);
  for (size_t i = 0; i < asked.size(); ++i)
    asked[i].desk->obey(command, [answers, i](Notice notice) { answers->take(i, std::move(notice)); });
}

std::string RecordDesks::text() const {
  std::string text, others;
  for (const Of& one : all_) {
    const std::string of_head = one.desk->text();
    std::string& where = of_head.empty() ? others : text;
    where += fmt::format("{}{}",
                         where.empty()     ? ""
                         : of_head.empty() ? ", "
                                           : " | ",
                         of_head.empty() ? one.head : of_head);
  }
  return text.empty() || others.empty() ? text : fmt::format("{} | not of {}", text, others);
}

}  // namespace strandcast

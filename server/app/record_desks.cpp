#include "server/app/record_desks.h"

#include <memory>
#include <utility>

#include "server/app/joined_answers.h"

namespace strandcast {
void RecordDesks::obey(const RecordCommand& command, const RecordDesk::Reply& reply) const {
  std::vector<Of> asked = all_;
  if (!command.is_wanted) std::erase_if(asked, [](const Of& one) { return one.desk->text().empty(); });
  if (asked.empty()) return all_.front().desk->obey(command, reply);
  std::vector<std::string> heads;
  for (const Of& one : asked) heads.push_back(one.head);
  const auto answers = std::make_shared<JoinedAnswers>(std::move(heads), reply);
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

#include "server/net/log_budget.h"

#include <utility>

namespace strandcast {

LogBudget::Verdict LogBudget::take(const std::string& address, int64_t time_ns) {
  Verdict verdict;
  if (time_ns >= window_end_ns_) {
    window_end_ns_ = time_ns + limits_.window_ns;
    verdict.left_out = std::exchange(left_out_, 0);
    lines_ = 0;
    lines_of_.clear();
  }
  if (lines_ < limits_.lines && lines_of_[address] < limits_.lines_per_address) {
    ++lines_;
    ++lines_of_[address];
    verdict.is_written = true;
  } else {
    ++left_out_;
  }
  return verdict;
}

}  // namespace strandcast

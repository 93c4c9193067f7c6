#include "server/net/address_guard.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace strandcast {

bool AddressGuard::take_connection(const std::string& address, int64_t time_ns) {
  return entry(address, time_ns).connections.take(time_ns);
}

bool AddressGuard::take_request(const std::string& address, int64_t time_ns) {
  return entry(address, time_ns).requests.take(time_ns);
}

bool AddressGuard::is_blocked(const std::string& address, int64_t time_ns) const {
  const auto found = entries_.find(address);
  return found != entries_.end() && time_ns < found->second.blocked_until_ns;
}

void AddressGuard::on_wrong_token(const std::string& address, int64_t time_ns) {
  Entry& one = entry(address, time_ns);
  std::erase_if(one.wrong_ns, [&](int64_t then_ns) { return then_ns <= time_ns - limits_.window_ns; });
  if (one.wrong_ns.size() < limits_.wrong_tokens) return one.wrong_ns.push_back(time_ns);
  one.wrong_ns.clear();
  one.blocked_until_ns = time_ns + limits_.block_ns;
}

void AddressGuard::ban(const std::string& address, int64_t time_ns, int64_t until_ns) {
  Entry& one = entry(address, time_ns);
  one.banned_until_ns = std::max(one.banned_until_ns, until_ns);
}

bool AddressGuard::is_banned(const std::string& address, int64_t time_ns) const {
  const auto found = entries_.find(address);
  return found != entries_.end() && time_ns < found->second.banned_until_ns;
}

AddressGuard::Entry& AddressGuard::entry(const std::string& address, int64_t time_ns) {
  auto found = entries_.find(address);
  if (found == entries_.end()) {
    if (entries_.size() >= limits_.addresses) make_room(time_ns);
    found = entries_.emplace(address, Entry(limits_)).first;
  }
  found->second.seen_ns = time_ns;
  return found->second;
}

/// Forgets the address that matters least: first those that are not banned, unblocked before blocked, then
/// without wrong tokens, then the one not seen for longest.
void AddressGuard::make_room(int64_t time_ns) {
  const auto worth = [&](const auto& item) {
    const Entry& one = item.second;
    return std::tuple(std::max(one.banned_until_ns, time_ns), std::max(one.blocked_until_ns, time_ns),
                      !one.wrong_ns.empty(), one.seen_ns);
  };
  const auto least = std::min_element(entries_.begin(), entries_.end(),
                                      [&](const auto& a, const auto& b) { return worth(a) < worth(b); });
  if (least != entries_.end()) entries_.erase(least);
}

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

bool RepeatBudget::take(const std::string& kind, const std::string& line) {
  Kind& one = kinds_[kind];
  if (one.lines < limits_.lines_per_kind && lines_ < limits_.lines) {
    ++one.lines;
    ++lines_;
    return true;
  }
  one.sum.newest = line;
  ++one.sum.count;
  return false;
}

std::vector<RepeatBudget::Sum> RepeatBudget::take_sums(int64_t time_ns) {
  std::vector<Sum> sums;
  if (time_ns < window_end_ns_) return sums;
  window_end_ns_ = time_ns + limits_.window_ns;
  lines_ = 0;
  std::erase_if(kinds_, [](const auto& kind) { return kind.second.sum.count == 0; });
  for (auto& [name, kind] : kinds_) {
    sums.push_back(std::exchange(kind.sum, {}));
    // What goes on is summed up, and not written again, until a window without it.
    kind.lines = limits_.lines_per_kind;
    ++lines_;
  }
  return sums;
}

}  // namespace strandcast

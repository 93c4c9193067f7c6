#include "tests/vopr/book.h"

#include <fmt/format.h>

#include <algorithm>

namespace strandcast::vopr {
namespace {

constexpr size_t kKeptStates = 20'000;

}  // namespace

Party& Book::add(const std::string& name, std::vector<NodeId> way, bool is_watcher) {
  parties_.push_back({name, std::move(way), 0, 0, world::time_ns(), is_watcher, false, 0});
  return parties_.back();
}

void Book::disturb(NodeId a, NodeId b, int64_t end_ns, int64_t extra_ns) {
  for (Party& party : parties_) {
    bool is_on_way = a == b && std::find(party.way.begin(), party.way.end(), a) != party.way.end();
    for (size_t i = 0; i + 1 < party.way.size(); ++i)
      is_on_way = is_on_way || (std::minmax(party.way[i], party.way[i + 1]) == std::minmax(a, b));
    if (!is_on_way) continue;
    const auto links = static_cast<int64_t>(party.way.size()) - 1;
    // What falls silent may be an attempt, of whoever is not well yet.
    const int64_t attempt_ns = extra_ns > 0 && !party.was_well ? kDoubtNs : 0;
    party.fault_end_ns = std::max(party.fault_end_ns, end_ns);
    party.due_ns =
        std::max(party.due_ns, end_ns + extra_ns + attempt_ns + links * kWaitNs + kBackNs + party.slow_ns);
    party.was_well = false;
  }
}

void Book::disturb(NodeId node, int64_t end_ns, int64_t extra_ns) {
  disturb(node, node, end_ns, extra_ns);
}

void Book::on_published(const Snapshot& state) {
  const uint64_t hash = state_hash(state);
  published_[state.tick].insert(hash);
  published_order_.push_back(state.tick);
  if (published_order_.size() <= kKeptStates) return;
  published_.erase(published_order_.front());
  published_order_.pop_front();
}

void Book::note_well(Party& party) {
  const int64_t time_ns = world::time_ns();
  party.fresh_ns = time_ns;
  if (party.was_well || time_ns < party.fault_end_ns) return;
  party.was_well = true;
  if (party.fault_end_ns > 0) back_ms_.push_back((time_ns - party.fault_end_ns) / kMs);
}

void Book::on_decoded(Party& party, const StateKey& key, uint64_t hash, bool is_exact) {
  note_well(party);
  ++compared_;
  if (is_exact) {
    const auto found = published_.find(key.tick);
    if (found != published_.end() && !found->second.contains(hash))
      world::fail(fmt::format("{} has another state {} than the server published", party.name, key.tick));
  }
  const auto [known, is_new] = decoded_.try_emplace(key, hash);
  if (known->second != hash)
    world::fail(fmt::format("{} has another state {} of stream {}, frame {}, than others", party.name,
                            key.tick, key.stream, key.sequence));
  if (!is_new) return;
  decoded_order_.push_back(key);
  if (decoded_order_.size() <= kKeptStates) return;
  decoded_.erase(decoded_order_.front());
  decoded_order_.pop_front();
}

void Book::on_line(const std::string& line) {
  for (const std::string& secret : secrets_)
    if (line.find(secret) != std::string::npos) world::fail("a token stands in the log: " + line);
  world::note(line);
  const size_t end = line.rfind(": ");
  if (line.find("[app]") == std::string::npos || end == std::string::npos) return;
  const auto asked = asked_.find(line.substr(end + 2));
  if (asked != asked_.end() && ++asked->second > 1)
    world::fail(fmt::format("the server has done '{}' twice", asked->first));
}

void Book::on_answered(const std::string& change) {
  if (!answers_.insert(change).second) world::fail(fmt::format("'{}' was answered twice", change));
  if (asked_.at(change) != 1) world::fail(fmt::format("'{}' was answered and not done", change));
}

void Book::check(int64_t time_ns) {
  for (const Party& party : parties_) {
    if (!party.is_watcher || time_ns < party.due_ns || time_ns - party.fresh_ns <= kFreshNs) continue;
    world::fail(fmt::format("{} has seen nothing new for {:.3f} s, and no fault is nearer than {:.3f} s",
                            party.name, static_cast<double>(time_ns - party.fresh_ns) * 1e-9,
                            static_cast<double>(time_ns - party.fault_end_ns) * 1e-9));
  }
}

int64_t Book::latest_due_ns() const {
  int64_t latest_ns = 0;
  for (const Party& party : parties_) latest_ns = std::max(latest_ns, party.due_ns + 2 * kFreshNs);
  return latest_ns;
}

std::vector<int64_t> Book::back_ms() const {
  std::vector<int64_t> sorted = back_ms_;
  std::sort(sorted.begin(), sorted.end());
  return sorted;
}

}  // namespace strandcast::vopr

// Book: what must always hold in a simulated run, and whether it does. A run that breaks a rule ends at once.
// One thread runs at a time (world.h), so that nothing here is locked.
#pragma once

#include <compare>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "common/client/reconnect_policy.h"
#include "common/strands/snapshot.h"
#include "tests/vopr/world.h"

namespace strandcast::vopr {

/// Within this after the end of a fault, and after the longest wait between two attempts, all are back.
inline constexpr int64_t kBackNs = 2 * kS;
/// The longest wait between two attempts.
inline constexpr int64_t kWaitNs = int64_t{kLongestUrgentDelay.count()} * kMs * 5 / 4;
/// Beside a connection or an attempt that nothing comes through another is tried after this.
inline constexpr int64_t kDoubtNs = int64_t{kDoubtedServer.count()} * kMs;
/// The newest state of a viewer that nothing disturbs came at most so long ago.
inline constexpr int64_t kFreshNs = 1 * kS;
/// An undisturbed controller has its answer within this.
inline constexpr int64_t kHeardNs = 1 * kS;

/// Somebody who must be well when nothing disturbs the way to the server.
struct Party {
  std::string name;
  std::vector<NodeId> way;  // its machine first, the server's last
  int64_t due_ns = 0;       // when it must be well again
  int64_t fault_end_ns = 0;
  int64_t fresh_ns = 0;  // when it was well last
  bool is_watcher = false;
  bool was_well = false;
  int64_t slow_ns = 0;  // that it may take longer than others
};

/// What all who decode it have the same bits of. A tick that is encoded again, for those who join, has
/// another number.
struct StateKey {
  std::string server;  // as it calls itself since its start
  uint16_t stream = 0;
  uint32_t sequence = 0;
  uint64_t tick = 0;
  auto operator<=>(const StateKey&) const = default;
};

class Book {
 public:
  explicit Book(std::vector<std::string> secrets) : secrets_(std::move(secrets)) {}

  Party& add(const std::string& name, std::vector<NodeId> way, bool is_watcher);
  /// All whose way has this machine, or goes from one of these to the other, are disturbed until that time,
  /// and must be well so long after that.
  void disturb(NodeId a, NodeId b, int64_t end_ns, int64_t extra_ns);
  void disturb(NodeId node, int64_t end_ns, int64_t extra_ns);

  void on_published(const Snapshot& state);
  void on_well(Party& party) { note_well(party); }
  /// A viewer has decoded a state. With `is_exact` the codec loses nothing.
  void on_decoded(Party& party, const StateKey& key, uint64_t hash, bool is_exact);
  /// A line of the log.
  void on_line(const std::string& line);
  /// A change that nobody else asks for is sent.
  void on_asked(const std::string& change) { asked_[change] = 0; }
  void on_answered(const std::string& change);
  /// What is asked for in a run stays asked for once, however often that is looked at.
  void check(int64_t time_ns);
  /// When all must be well again, if nothing more happens.
  int64_t latest_due_ns() const;

  uint64_t compared() const { return compared_; }
  uint64_t answered() const { return answers_.size(); }
  /// How long after the end of a fault parties were well again, ms, sorted.
  std::vector<int64_t> back_ms() const;

 private:
  void note_well(Party& party);

  std::vector<std::string> secrets_;
  std::deque<Party> parties_;
  std::map<uint64_t, std::set<uint64_t>> published_;  // hashes of a tick, of the newest runs
  std::deque<uint64_t> published_order_;
  std::map<StateKey, uint64_t> decoded_;
  std::deque<StateKey> decoded_order_;
  std::map<std::string, int> asked_;  // changes, and how often the server has begun them
  std::set<std::string> answers_;
  std::vector<int64_t> back_ms_;
  uint64_t compared_ = 0;
};

}  // namespace strandcast::vopr

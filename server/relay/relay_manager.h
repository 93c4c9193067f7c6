// RelayManager: what a relay does with the sessions of one head: lets them in as the server above would, says
// which streams they need, and passes on what they say. Network thread, unless said otherwise.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include "server/app/codec_manager.h"
#include "server/app/stream_announcer.h"
#include "server/net/net_server.h"
#include "server/relay/uplinks.h"
#include "server/relay/upstream.h"

namespace strandcast {

/// What the managers of one relay have in common; all outlives the sessions.
struct RelayManagerParts {
  std::string id;             // the relay's own
  bool has_all_heads = true;  // or one alone
  Uplinks& uplinks;
  std::function<UpstreamCounters()> counters;  // of all heads
};

class RelayManager : public NetHandler {
 public:
  /// `number`: of the head, as NetServer has it. `upstream` outlives the sessions.
  RelayManager(RelayManagerParts parts, Upstream& upstream, size_t number)
      : parts_(std::move(parts)), upstream_(upstream), number_(number) {}

  /// Before `net` starts; it outlives the sessions.
  void connect(NetServer& net);
  // From any thread.
  void set_relayed(RelayedPtr relayed);
  /// All look from there who let others move their view.
  void move_views(const CameraChange& camera);
  uint32_t viewer_count() const { return viewer_count_; }
  bool is_shut_down_wanted() const { return is_shut_down_wanted_; }

  Result<Admission> on_hello(const Visitor& visitor, const Hello& hello) override;
  void on_message(SessionId session, const ClientMessage& message, int64_t arrival_ns) override;
  void on_need(SessionId session, const StreamNeed& need) override;
  void on_change(SessionId, SubscriptionChange change) override {
    if (change == SubscriptionChange::Strands) follow_demand();
  }
  LinkAnswer on_link(SessionId session, const LinkState& link, int64_t time_ns) override;
  void on_left(SessionId session) override;
  Status readiness() override { return upstream_.readiness(); }
  std::string metrics() override;

 private:
  struct Leaf {
    Hello hello;
    std::string address;  // what counts as one
    Subscription* subscription = nullptr;
    ViewerReport report;
    bool is_answer_due = false;  // to a ModeRequest
  };
  RelayedPtr relayed() const;
  Status check(const Hello& hello, const Relayed& relayed) const;
  SimulatedModel model(const Relayed& relayed) const;
  void say(SessionId session, const ClientMessage& message);
  void follow_window(SessionId session, Leaf& leaf, const WindowChange& window);
  void follow_demand();

  const RelayManagerParts parts_;
  Upstream& upstream_;
  const size_t number_;
  NetServer* net_ = nullptr;
  StreamAnnouncer announcer_;
  std::map<SessionId, Leaf> leaves_;
  std::optional<CodecManager> codecs_;  // of the server above as it is now
  std::string codecs_of_;               // its session_id
  mutable std::mutex mutex_;            // guards the two below
  RelayedPtr relayed_;
  std::set<SessionId> movable_;
  std::atomic<uint32_t> viewer_count_{0};
  std::atomic<bool> is_shut_down_wanted_{false};
};

}  // namespace strandcast

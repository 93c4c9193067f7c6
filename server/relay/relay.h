// Relay: passes the streams of another server, or relay, on to viewers of its own: no scene, no simulation.
// Threads: the network's; for each head one for its streams and one for its uplinks; one for each session at
// the server above. Several relays may live in one process.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "server/relay/relay_manager.h"

namespace strandcast {

struct RelayConfig {
  NetConfig net;
  UpstreamConfig upstream;
  int64_t idle_uplink_ns = kIdleUplinkNs;
};

class Relay {
 public:
  /// Opens the port and begins to connect: until that is done viewers are told to try later. Every error is
  /// one sentence for a person.
  static Result<std::unique_ptr<Relay>> start(const RelayConfig& config);
  /// Calls stop() unless somebody has.
  ~Relay() { stop(); }
  Relay(const Relay&) = delete;
  Relay& operator=(const Relay&) = delete;

  uint16_t port() const { return net_->port(); }
  /// Returns the number of viewers of all heads together.
  uint32_t viewer_count() const;
  UpstreamCounters counters() const;
  NetCounters net_counters() const { return net_->counters(); }
  /// As /readyz.
  Status readiness() const;
  /// As NetServer::reload_tls().
  Status reload_tls() { return net_->reload_tls(); }
  /// As NetServer::set_tokens().
  Status set_tokens(std::vector<AccessToken> tokens) { return net_->set_tokens(std::move(tokens)); }
  /// True once an admin has asked for the end.
  bool is_shut_down_wanted() const;
  /// Why it cannot go on; nothing while all is well.
  std::optional<Error> failure() const { return heads_.front()->upstream.failure(); }
  void stop();

 private:
  /// One head, or a place for one that the server above may have.
  struct RelayedHead {
    Upstream upstream;
    RelayManager manager;

    RelayedHead(const UpstreamConfig& config, const RelayManagerParts& parts, size_t number)
        : upstream(config, parts.id, number), manager(parts, upstream, number) {}
  };

  explicit Relay(const RelayConfig& config);
  void follow_heads(const std::vector<std::string>& names);

  // In the order in which each is used by those below it.
  Uplinks uplinks_;
  std::vector<std::unique_ptr<RelayedHead>> heads_;  // the first first
  std::unique_ptr<NetServer> net_;
};

}  // namespace strandcast

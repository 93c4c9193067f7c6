// Relay: passes the stream of another server, or relay, on to viewers of its own: no scene, no simulation.
// Threads: the network's, one for what is got and one for who says something, and one for each session at the
// server above. Several may live in one process.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "server/relay/relay_desk.h"

namespace strandcast {

struct RelayConfig {
  NetConfig net;
  UpstreamConfig upstream;
};

class Relay {
 public:
  /// Opens the port and begins to connect: until that is done viewers are told to try later. Every error is
  /// one sentence for a person.
  static Result<std::unique_ptr<Relay>> start(const RelayConfig& config);
  /// stop(), if it was not called.
  ~Relay() { stop(); }
  Relay(const Relay&) = delete;
  Relay& operator=(const Relay&) = delete;

  uint16_t port() const { return net_->port(); }
  uint32_t viewer_count() const { return desk_.viewer_count(); }
  UpstreamCounters counters() const { return upstream_.counters(); }
  NetCounters net_counters() const { return net_->counters(); }
  /// As /readyz.
  Status readiness() const { return upstream_.readiness(); }
  /// As NetServer::reload_tls().
  Status reload_tls() { return net_->reload_tls(); }
  /// As NetServer::set_tokens().
  Status set_tokens(std::vector<AccessToken> tokens) { return net_->set_tokens(std::move(tokens)); }
  /// True once an admin has asked for the end.
  bool is_shut_down_wanted() const { return desk_.is_shut_down_wanted(); }
  /// Why it cannot go on; nothing while all is well.
  std::optional<Error> failure() const { return upstream_.failure(); }
  void stop();

 private:
  explicit Relay(const RelayConfig& config);

  const std::string id_;
  // In the order in which each is used by those below it.
  Upstream upstream_;
  Voices voices_;
  RelayDesk desk_;
  std::unique_ptr<NetServer> net_;
};

}  // namespace strandcast

// SteadyClient: a ViewerClient that comes back by itself, for who feeds or looks on. One thread; connecting
// happens beside it.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>

#include "common/client/attempts.h"

namespace strandcast {

class SteadyClient {
 public:
  using OnEvent = std::function<void(ClientEvent&)>;

  explicit SteadyClient(const ClientConfig& config)
      : attempts_(config, [](const ClientConfig& one) { return ViewerClient::connect(one); }) {}

  /// Hands what arrived to `on_event`, waiting up to `timeout` for it; starts and finishes attempts. The
  /// error is one that trying again does not mend.
  Status pump(std::chrono::milliseconds timeout, const OnEvent& on_event);
  /// Waits for the first Welcome, `limit` at most. Unavailable when `stop` was set, Timeout after the limit,
  /// or the final error.
  Status await_welcome(const std::atomic<bool>& stop,
                       std::chrono::milliseconds limit = std::chrono::milliseconds::max());

  /// Null while there is no connection.
  ViewerClient* client() { return client_.get(); }
  /// Returns whether there is a connection on which the server said something within kSilentServer, behind a
  /// relay too.
  bool is_connected() const { return client_ != nullptr && silent_since_ns(heard(), now_ns()) == 0; }
  /// Returns the Welcome of the newest connection; there must have been one.
  const Welcome& welcome() const { return welcome_; }
  const ReconnectPolicy& policy() const { return attempts_.policy(); }

 private:
  Heard heard() const { return {client_->heard_ns(), away_since_ns_}; }

  Attempts<ViewerClient> attempts_;
  std::unique_ptr<ViewerClient> client_;
  Welcome welcome_;
  int64_t away_since_ns_ = 0;  // as in Heard
};

}  // namespace strandcast

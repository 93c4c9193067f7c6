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
  /// Returns whether there is a connection on which the server said something within kSilentServer.
  bool is_connected() const { return client_ != nullptr && !is_silent(client_->heard_ns(), now_ns()); }
  /// Returns the Welcome of the newest connection; there must have been one.
  const Welcome& welcome() const { return welcome_; }
  const ReconnectPolicy& policy() const { return attempts_.policy(); }

 private:
  void tell_silence();

  Attempts<ViewerClient> attempts_;
  std::unique_ptr<ViewerClient> client_;
  Welcome welcome_;
  bool has_told_silence_ = false;
};

}  // namespace strandcast

// ViewerClient: one WebSocket connection to a server, for viewers, controllers and sources. An own thread
// does all network work; the application takes events from a bounded mailbox and sends through a bounded
// queue, so neither side can make the other grow. Every received byte is untrusted. Does not decode frames
// and does not reconnect.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/client/address.h"
#include "common/client/mailbox.h"
#include "common/replay/clock_offset.h"
#include "common/wire/messages.h"

namespace strandcast {

/// Steps of connecting, in order.
enum class ConnectStep { FindHost, Connect, BeginTls, AskForWebSocket, AwaitWelcome };
/// Describes a step for a person: "looking for the host".
const char* to_string(ConnectStep step);

struct ClientConfig {
  Address address;
  std::filesystem::path tls_authorities;  // PEM, for an address with TLS; empty: the system's
  std::string path = "/v1";
  Hello hello;
  /// A slow link delays and drops states of a ViewerSession, and does not thin them: it acknowledges nothing
  /// then.
  bool keeps_all_strands = false;
  std::chrono::milliseconds connect_timeout{5000};  // name, TCP and WebSocket handshake together
  std::chrono::milliseconds welcome_timeout{5000};  // from the handshake to the Welcome
  std::chrono::milliseconds idle_timeout{15'000};   // nothing received for this long: the server is gone
  MailboxLimits mailbox;
  /// Called every kCancelPoll by the thread that waits in ViewerClient::connect(); a returned error ends the
  /// wait. Empty: never.
  std::function<std::optional<Error>()> cancel;
  /// Called on the connection's own thread when a step begins. Empty: not called.
  std::function<void(ConnectStep)> on_step;

  // Out of line: copied and taken apart in many files, which need no copy of that code.
  ClientConfig();
  ClientConfig(const ClientConfig&);
  ClientConfig(ClientConfig&&) noexcept;
  ClientConfig& operator=(const ClientConfig&);
  ClientConfig& operator=(ClientConfig&&) noexcept;
  ~ClientConfig();
};

inline constexpr std::chrono::milliseconds kCancelPoll{20};
/// Largest HTTP answer to the WebSocket request.
inline constexpr uint64_t kMaxUpgradeAnswerBytes = 16u << 10;

inline constexpr int kQuickPings = 10;  // clock probes right after the Welcome
inline constexpr std::chrono::milliseconds kQuickPingInterval{20};
inline constexpr std::chrono::milliseconds kPingInterval{1000};
inline constexpr std::chrono::milliseconds kKeyframeRequestInterval{
    1000};  // at most one request in this time

inline constexpr size_t kMaxSendQueueMessages = 1024;
inline constexpr size_t kMaxSendQueueBytes = 1u << 20;

/// Messages that wait to be sent to the server, in order. Any thread adds, the network thread removes.
class Outbox {
 public:
  /// Adds a message. LimitExceeded if the box is full (the message is dropped), Unavailable once it is
  /// closed.
  Status push(std::vector<std::byte> message);
  /// Returns the oldest message, which stays until pop(); empty if there is none.
  std::span<const std::byte> front() const;
  void pop();
  /// Closes the box: nothing can be added any more.
  void close();

  size_t message_count() const;

 private:
  mutable std::mutex mutex_;
  std::deque<std::vector<std::byte>> messages_;
  size_t bytes_ = 0;
  bool is_closed_ = false;
};

struct ConnectionCounters {
  uint64_t received_bytes = 0;  // payload of WebSocket messages
  uint64_t received_messages = 0;
  uint64_t unknown_messages = 0;  // of a kind or opcode that a later version may know; ignored
  uint64_t sent_messages = 0;
  uint64_t dropped_frames = 0;  // the application was too slow
};

class ViewerClient {
 public:
  /// Blocks until the server has sent its Welcome. Unavailable: nobody listens or the connection broke;
  /// Timeout; Unauthorized: the server refused token or role, or its certificate is not to be trusted;
  /// Unsupported: another version, no TLS, a ring of relays; NotFound: no such session or head;
  /// LimitExceeded: the server is full; BadInput: what came is no answer of this protocol; or what
  /// config.cancel says. is_final() tells those that trying again does not mend.
  static Result<std::unique_ptr<ViewerClient>> connect(const ClientConfig& config);
  /// Says goodbye to the server (waiting a fraction of a second at most) and ends the network thread.
  ~ViewerClient();
  ViewerClient(const ViewerClient&) = delete;
  ViewerClient& operator=(const ViewerClient&) = delete;

  const Welcome& welcome() const;

  /// Returns the events since the last call, in order; nothing follows a ClosedEvent. Call it from one
  /// application thread.
  std::vector<ClientEvent> poll();
  /// Returns like poll(), but waits up to `timeout` for the first event.
  std::vector<ClientEvent> wait(std::chrono::milliseconds timeout);
  /// Returns the next event like Mailbox::next().
  std::optional<ClientEvent> next(std::chrono::milliseconds timeout);

  /// Queues a message. LimitExceeded if the outbox is full (the message is dropped), Unavailable if the
  /// connection is over. Any thread.
  Status send(const ClientMessage& message);
  /// Requests a keyframe, at most once per kKeyframeRequestInterval; further calls do nothing. Any thread.
  void request_keyframe();
  /// Returns the number of messages that are queued and not yet written. Any thread.
  size_t queued_messages() const;

  /// Returns a copy of the clock estimate, which has no value before the first probe returned. Any thread.
  ClockOffset clock() const;
  ConnectionCounters counters() const;
  /// When something came from the server last, by now_ns(); in the middle of a long message within
  /// kPingInterval. Any thread.
  int64_t heard_ns() const;

 private:
  class Connection;
  explicit ViewerClient(std::unique_ptr<Connection> connection);
  std::unique_ptr<Connection> connection_;
};

}  // namespace strandcast

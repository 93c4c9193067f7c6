// LiveReceiver: the sockets of live motion capture, on a thread of their own: ports that senders' datagrams
// come in by, with a multicast group where one is joined, and connections to servers that are asked. It knows
// no protocol and judges no packet: bytes go to a LiveHandler. What is heard without being asked for comes
// from loopback alone, unless ranges of addresses are allowed.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server/net/ip_address.h"

namespace strandcast {

/// Time until a failed connection to a server is tried again.
inline constexpr int64_t kLiveRetryMs = 500;
/// Time between two requests, for protocols that have them.
inline constexpr int64_t kLiveRequestMs = 1'000;
/// Between two ticks, of inputs that are active and of none.
inline constexpr int64_t kLiveTickMs = 5;
inline constexpr int64_t kLiveIdleTickMs = 100;

/// Network address of one input.
struct LivePort {
  std::string field;           // of the scene, for errors
  std::string protocol;        // likewise
  bool is_connection = false;  // a server is asked over TCP
  std::string host = {};       // that is asked, or a multicast group; empty: whoever sends
  std::string group = {};     // to be joined where there is no host, as soon as more than loopback is allowed
  uint16_t port = 0;          // here, or (is_connection) of the server
  uint16_t request_port = 0;  // of who is asked by datagrams; 0 = nobody is
};

/// Receiver of the data. Called on the receiver's thread, so functions must return quickly without waiting.
class LiveHandler {
 public:
  virtual ~LiveHandler() = default;
  /// Handles received bytes; `sender` is an address with its port. Returns false if the connection must be
  /// closed.
  virtual bool on_bytes(size_t input, const std::string& sender, std::span<const std::byte> bytes,
                        int64_t arrival_ns) = 0;
  /// Reports a datagram from an address that may not send, and how to permit it.
  virtual void on_refused(size_t input, const std::string& sender, const std::string& remedy) = 0;
  /// Reports that a connection has begun.
  virtual void on_connection(size_t input) = 0;
  /// Reports that a connection failed or ended.
  virtual void on_no_connection(size_t input, const std::string& why) = 0;
  /// Returns the bytes to send at the beginning, and about once a second; empty = nothing.
  virtual std::vector<std::byte> greeting(size_t input) = 0;
  virtual std::vector<std::byte> request(size_t input) = 0;
  /// Does periodic work; returns false if there is none until data arrives.
  virtual bool on_tick(int64_t now_ns) = 0;
};

class LiveReceiver {
 public:
  /// Opens the sockets; received data waits until start(). `handler` must outlive the receiver. Errors name
  /// the field: Unavailable for a port in use, NotFound for an unknown host.
  static Result<std::unique_ptr<LiveReceiver>> open(const std::vector<LivePort>& ports,
                                                    const std::vector<AddressRange>& allowed,
                                                    LiveHandler& handler);
  /// stop(), if it was not called.
  ~LiveReceiver();
  LiveReceiver(const LiveReceiver&) = delete;
  LiveReceiver& operator=(const LiveReceiver&) = delete;

  /// Starts the thread. Call once.
  void start();
  void stop();

 private:
  struct State;
  explicit LiveReceiver(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace strandcast

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

/// Until a server that was asked is tried again.
inline constexpr int64_t kLiveRetryMs = 500;
/// Between two requests, where a protocol has any.
inline constexpr int64_t kLiveRequestMs = 1'000;
/// Between two ticks, of inputs that are active and of none.
inline constexpr int64_t kLiveTickMs = 5;
inline constexpr int64_t kLiveIdleTickMs = 100;

/// One input's place on the network.
struct LivePort {
  std::string field;           // of the scene, for errors
  std::string protocol;        // likewise
  bool is_connection = false;  // a server is asked over TCP
  std::string host = {};       // that is asked, or a multicast group; empty: whoever sends
  std::string group = {};     // to be joined where there is no host, as soon as more than loopback is allowed
  uint16_t port = 0;          // here, or (is_connection) of the server
  uint16_t request_port = 0;  // of who is asked by datagrams; 0 = nobody is
};

/// Called on the receiver's thread: return quickly, never wait.
class LiveHandler {
 public:
  virtual ~LiveHandler() = default;
  /// False: the connection is of no use any more. `sender` is an address with its port.
  virtual bool on_bytes(size_t input, const std::string& sender, std::span<const std::byte> bytes,
                        int64_t arrival_ns) = 0;
  /// A datagram came from an address that may not send; what would let it.
  virtual void on_refused(size_t input, const std::string& sender, const std::string& remedy) = 0;
  /// A connection begins.
  virtual void on_connection(size_t input) = 0;
  /// A connection cannot be had, or ended.
  virtual void on_no_connection(size_t input, const std::string& why) = 0;
  /// To be sent first, and about once a second; empty = nothing.
  virtual std::vector<std::byte> greeting(size_t input) = 0;
  virtual std::vector<std::byte> request(size_t input) = 0;
  /// False while there is nothing to do until something comes.
  virtual bool on_tick(int64_t now_ns) = 0;
};

class LiveReceiver {
 public:
  /// Opens the sockets; what comes waits until start(). `handler` outlives the receiver. Errors name the
  /// field: Unavailable for a port in use, NotFound for a host that cannot be found.
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

// What the listener, the HTTP connections and the sessions of one NetServer share. Network thread, except
// counters.
#pragma once

#include <boost/asio/io_context.hpp>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "server/net/address_guard.h"
#include "server/net/net_server.h"
#include "server/net/send_queue.h"
#include "server/net/stream_costs.h"

namespace strandcast::net {

class Connection;
class Session;

/// Bytes handed to the kernel at once: a write without progress is noticed per chunk, not per frame.
inline constexpr size_t kWriteChunkBytes = 64u << 10;
/// Connections beyond the sessions: HTTP requests, and those that are told that the server is full.
inline constexpr size_t kSpareConnections = 64;
inline constexpr size_t kSpareConnectionsPerAddress = 16;

/// First line and fields of a request.
inline constexpr size_t kMaxHttpHeaderBytes = 8u << 10;
/// What is read of a request: the header, and one byte that tells a longer one. The rest waits in the kernel.
inline constexpr size_t kMaxHttpReadBytes = kMaxHttpHeaderBytes + 1;

/// A message of the largest size and the buffer's own steps.
inline constexpr size_t kMaxSessionReadBytes = kMaxControlBytes + (4u << 10);
/// Enough to keep a long fast link busy; the kernel takes twice as much for its own.
inline constexpr size_t kSendBufferBytes = 1u << 20;
/// OpenSSL's records both ways, and Asio's.
inline constexpr size_t kMaxTlsBytes = 128u << 10;
/// What one client can make the server hold, besides the frames that it shares with others.
inline constexpr size_t kMaxSessionMemoryBytes = 8u << 20;
static_assert(kMaxSessionReadBytes + kMaxTlsBytes + 2 * kSendBufferBytes +
                  (kMaxQueuedControl + 1) * kMaxControlBytes <=
              kMaxSessionMemoryBytes);

/// The other end of a connection.
struct Peer {
  std::string address;
  std::string key;          // what counts as one address: of IPv6 the network of 64 bits
  bool is_trusted = false;  // on trusted loopback
  int64_t accepted_ns = 0;
};

struct Context {
  Context(const NetConfig& net_config, NetHandler& net_handler);

  void count(uint64_t NetCounters::*field, uint64_t amount = 1) {
    const std::lock_guard lock(mutex);
    counters.*field += amount;
  }
  NetCounters counters_now() const {
    const std::lock_guard lock(mutex);
    return counters;
  }
  /// True while another session of this peer fits; sessions that are closing do not count.
  bool has_room(const std::string& peer_key) const;
  /// Those that have joined.
  SessionList list_sessions(int64_t time_ns) const;
  /// Ends a session; false when there is none of this number.
  bool kick(SessionId id);
  /// Publishes the number of open and joined sessions.
  void update_session_counts();

  const NetConfig config;
  NetHandler& handler;
  StrandCosts strands;
  PictureCosts pictures;
  boost::asio::io_context io{1};
  std::map<SessionId, std::shared_ptr<Session>> sessions;
  std::set<std::shared_ptr<Connection>> connections;
  SessionId next_session = 1;
  bool is_stopping = false;
  AddressGuard guard;
  TlsContextPtr tls;  // null: no TLS

 private:
  mutable std::mutex mutex;
  NetCounters counters;
};

}  // namespace strandcast::net

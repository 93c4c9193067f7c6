// What the listener, the HTTP connections and the sessions of one NetServer share. Network thread, except
// counters.
#pragma once

#include <boost/asio/io_context.hpp>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/histogram.h"
#include "common/log/log.h"
#include "server/net/address_guard.h"
#include "server/net/asset_forms.h"
#include "server/net/net_server.h"
#include "server/net/refusal_private.h"
#include "server/net/send_queue.h"
#include "server/net/stream_costs.h"

namespace strandcast::net {

class Connection;
class Session;

/// Bytes handed to the kernel at once: a write without progress is noticed per chunk, not per frame.
inline constexpr size_t kWriteChunkBytes = 64u << 10;
/// Connections without a Hello that was accepted: HTTP requests, and sessions that begin or end. They have
/// places of their own, so that they can take none of the sessions'; trusted loopback has its own again.
inline constexpr size_t kSpareConnections = 64;
inline constexpr size_t kSpareConnectionsPerAddress = 16;
inline constexpr const char* kBlockedSentence =
    "Too many wrong tokens came from this address: wait a minute.";

/// On one connection; the last answer ends it.
inline constexpr size_t kMaxRequestsOfConnection = 100;
/// An answer whose taker takes less than this in handshake_ms does not get on.
inline constexpr size_t kLeastProgressBytes = 4u << 10;

/// First line and fields of a request.
inline constexpr size_t kMaxHttpHeaderBytes = 8u << 10;
/// What is read of a request: the header, and one byte that tells a longer one. The rest waits in the kernel.
inline constexpr size_t kMaxHttpReadBytes = kMaxHttpHeaderBytes + 1;

/// A message of the largest size and the buffer's own steps.
inline constexpr size_t kMaxSessionReadBytes = kMaxControlBytes + (4u << 10);
/// On the wire, from one message to the next: a message of single bytes, each a fragment of its own, fits.
inline constexpr size_t kMaxBytesOfMessage = 16 * kMaxControlBytes;
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
  bool is_proxy = false;    // a proxy of ours, which has not said yet for whom it connects
  int64_t accepted_ns = 0;
};

/// What sessions of one head share.
struct Head {
  explicit Head(const NetHead& head)
      : name(head.name), handler(*head.handler), strands(head.strand_classes, head.strand_codecs) {}

  std::string name;
  NetHandler& handler;
  StrandCosts strands;
  PictureCosts pictures;
  AssetForms assets;
};

struct Context {
  Context(const NetConfig& net_config, const std::vector<NetHead>& net_heads);

  void count(uint64_t NetCounters::*field, uint64_t amount = 1) {
    const std::lock_guard lock(mutex);
    counters.*field += amount;
  }
  NetCounters counters_now() const {
    const std::lock_guard lock(mutex);
    return counters;
  }
  /// Counts, and leaves a line in the log while there is room for it. `detail` may hold what the peer wrote.
  void refuse(Refusal why, const Peer& peer, std::string_view detail);
  /// A line about a session while there is room for it.
  void note(const std::string& line, LogLevel level = LogLevel::Info);
  /// True while another session of this peer fits, or would in the place of one that may be dead; only those
  /// that joined count.
  bool has_room(const std::string& peer_key) const;
  /// Ends the one that may be dead; false when there is no room.
  bool make_room(const std::string& peer_key);
  /// How many of this peer have no Hello that was accepted.
  size_t waiting_of(const std::string& peer_key) const;
  /// True when one more may wait for its Hello. One between two requests gives its place first; among
  /// strangers then the oldest of the address that has most.
  bool make_place(const Peer& peer);
  /// Returns the sessions that have joined.
  SessionList list_sessions(int64_t time_ns) const;
  /// Ends a session; false when there is none of this number.
  bool kick(SessionId id);
  /// What counts as the address of a session; none when there is none of this number.
  std::optional<std::string> key_of(SessionId id) const;
  /// Number of the head of this name, or of the first where the name is empty or the first has none;
  /// NotFound says which there are.
  Result<size_t> find_head(const std::string& name) const;
  /// All of them are stepping, or why not.
  Status readiness();
  /// Publishes the number of open and joined sessions.
  void update_session_counts();

  const NetConfig config;
  std::vector<AccessToken> tokens;  // of now
  std::vector<Head> heads;
  boost::asio::io_context io{1};
  std::map<SessionId, std::shared_ptr<Session>> sessions;
  std::set<std::shared_ptr<Connection>> connections;
  SessionId next_session = 1;
  bool is_stopping = false;
  AddressGuard guard;
  LogBudget refusal_lines;
  LogBudget session_lines;
  Histogram queue_delays;       // of all viewers, as often as their links are looked at
  TlsContextPtr tls;            // null: no TLS
  int64_t clock_offset_ns = 0;  // of the clock that frames are stamped with, against ours

 private:
  struct Room {
    bool is_free = false;
    Session* doubted = nullptr;  // silent for longest of those that may be dead, and whose end makes room
  };
  Room look_for_room(const std::string& peer_key) const;

  mutable std::mutex mutex;
  NetCounters counters;
};

}  // namespace strandcast::net

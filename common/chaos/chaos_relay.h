// ChaosRelay: a TCP relay in user space that degrades a link on purpose. It adds delay, jitter, a rate with a
// bounded queue, freezes, resets, half-open connections, corruption, and split or merged writes. Needs no
// privileges and no kernel module. Runs on its own thread; the functions may be called from any thread. It
// does not interpret the bytes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "common/base/result.h"

namespace strandcast::chaos {

/// How the relay splits the bytes that it writes.
enum class Writes {
  AsRead,   // as they came
  OneByte,  // every byte in a write of its own
  Split,    // in writes of 1 to kMaxSplitBytes bytes
  Merged,   // what came within kMergeWindowUs, at once
};
inline constexpr size_t kMaxSplitBytes = 61;
inline constexpr int64_t kMergeWindowUs = 20'000;
/// From the moment that a lost segment is missed to the one when it is sent again.
inline constexpr int64_t kResendUs = 10'000;

/// Faults of one direction of every connection.
struct LinkPlan {
  int64_t delay_us = 0;
  int64_t jitter_us = 0;            // added to the delay, uniform in 0..jitter; order is kept, as in TCP
  double loss = 0.0;                // share of segments that come a round trip and kResendUs later, as TCP
                                    // sends them again; those behind them wait
  uint64_t bytes_per_s = 0;         // 0 = as fast as it goes
  size_t queue_bytes = 128u << 10;  // may wait for the rate; beyond it the relay stops reading
  int64_t freeze_every_us = 0;      // 0 = never; else nothing passes for freeze_us at the end of each period
  int64_t freeze_us = 0;
  uint64_t reset_after_bytes = 0;   // 0 = never; else both ends get a TCP reset after this many bytes
  uint64_t silent_after_bytes = 0;  // 0 = never; else everything is swallowed: the peer looks half-open
  double corrupt_per_byte = 0.0;    // chance that one bit of a byte is turned
  Writes writes = Writes::AsRead;
};

enum class Direction { Up, Down };  // to the server, to the client

struct RelayConfig {
  std::string listen_host = "127.0.0.1";
  uint16_t listen_port = 0;  // 0 = any free port
  std::string to_host = "127.0.0.1";
  uint16_t to_port = 0;
  LinkPlan up, down;
  // Corruption and cuts depend on it, on the connection's number and on the byte's place only.
  uint64_t seed = 1;
};

struct RelayCounters {
  uint64_t connections = 0;                   // accepted so far
  uint64_t open_connections = 0;              // now
  uint64_t refused = 0;                       // the other side could not be reached
  uint64_t resets = 0;                        // made by the relay
  std::array<uint64_t, 2> bytes{};            // passed on, by Direction
  std::array<uint64_t, 2> corrupted_bytes{};  // by Direction
  std::array<uint64_t, 2> swallowed_bytes{};  // by Direction
  uint64_t most_queued_bytes = 0;             // of one direction of one connection
};

/// Upper limit of the bytes held for one direction of one connection, including delayed ones.
inline constexpr size_t kMaxHeldBytes = 8u << 20;

class ChaosRelay {
 public:
  /// Starts the relay. Unavailable if the port is taken, BadInput for an invalid host.
  static Result<std::unique_ptr<ChaosRelay>> start(const RelayConfig& config);
  /// Closes all connections and ends the thread.
  ~ChaosRelay();
  ChaosRelay(const ChaosRelay&) = delete;
  ChaosRelay& operator=(const ChaosRelay&) = delete;

  uint16_t port() const;
  /// Applies a plan to existing and new connections; bytes already queued keep their times.
  void set_plan(Direction direction, const LinkPlan& plan);
  /// Freezes or releases the relay: while frozen, it neither reads nor writes in either direction.
  void set_frozen(bool is_frozen);
  /// Makes the relay a black hole: while silent, it discards all bytes and passes on no close. It accepts new
  /// connections but connects them to nothing.
  void set_silent(bool is_silent);
  /// Resets all current connections (TCP RST) at both ends.
  void reset_all();
  /// Sets the port that new connections are forwarded to.
  void set_to_port(uint16_t port);
  RelayCounters counters() const;

 private:
  class State;
  explicit ChaosRelay(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace strandcast::chaos

// LoadViewers: many viewers of one server on one thread, without decoding: they join, acknowledge, measure
// when frames arrive, stall or leave on purpose. Shares no code with the product's client below the messages,
// so that what it measures is the server. Not thread-safe.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/wire/messages.h"

namespace strandcast::load {

/// Bytes that may wait to be written to a server that does not read; a viewer with more is ended.
inline constexpr size_t kMaxUnsentBytes = 1u << 20;
/// Values kept of each list of LoadMeasures; further ones take the places of others at random.
inline constexpr size_t kMaxMeasuredValues = 1u << 20;

/// What one viewer does.
struct ViewerPlan {
  StreamMode mode = StreamMode::Strands;
  bool acknowledges = true;
  bool reads = true;  // false: joins, then takes nothing any more
};

/// TLS; the server's certificate must be signed by these authorities (PEM; empty: the system's) for the host.
struct Encryption {
  std::filesystem::path authorities;
};

struct LoadConfig {
  std::string host = "127.0.0.1";  // numeric
  uint16_t port = 0;
  std::string token;
  std::optional<Encryption> encryption = std::nullopt;
  double step_ns = 0.0;     // as in Hello; 0 = as viewers that cannot predict
  std::string folder = {};  // as Address::folder()
};

/// Totals since the start or the last reset_measures(); the vectors hold one value per frame, within
/// kMaxMeasuredValues.
struct LoadMeasures {
  uint64_t frames = 0;
  uint64_t keyframes = 0;
  uint64_t bytes = 0;
  uint64_t chain_errors = 0;  // deltas whose base this viewer had not received: must be 0
  uint64_t quality_changes = 0;
  StreamQuality newest_quality;    // of any viewer; survives a reset, as the next one does
  float newest_quality_ms = 0.0f;  // from that viewer's first frame
  uint64_t joined = 0;
  std::map<std::string, uint64_t> joined_by_codec;  // of those who get strands; survives a reset
  uint64_t ended = 0;                               // by the server or the network, not by leave()
  std::map<uint16_t, uint64_t> close_codes;         // of those; 0 = broken off
  std::string last_goodbye;
  std::vector<float> interval_ms;  // between two frames of one viewer
  std::vector<float> latency_ms;   // from the server's send time; one machine, one clock
};

class LoadViewers {
 public:
  explicit LoadViewers(const LoadConfig& config);
  ~LoadViewers();
  LoadViewers(const LoadViewers&) = delete;
  LoadViewers& operator=(const LoadViewers&) = delete;

  /// Starts to connect one more; its number. Unavailable when there are no file descriptors left, BadInput
  /// when the authorities cannot be read.
  Result<uint64_t> join(const ViewerPlan& plan);
  /// Closes the connection of a viewer; `is_rude`: with a TCP reset.
  void leave(uint64_t viewer, bool is_rude);
  /// The oldest viewer's number; 0 when there is none.
  uint64_t oldest() const;
  /// Handles what arrives for so long.
  void run_for(int64_t duration_ms);

  size_t open_count() const;
  /// Those that have received a frame.
  size_t watching_count() const;
  const LoadMeasures& measures() const;
  void reset_measures();

 private:
  class State;
  std::unique_ptr<State> state_;
};

}  // namespace strandcast::load

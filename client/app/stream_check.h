// Checks a running server through its viewers: decodes frames with one viewer, joins a second one half way,
// and compares the state hashes of all ticks that both decoded. One thread.
#pragma once

#include <compare>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>

#include "common/base/result.h"
#include "common/client/viewer_client.h"

namespace strandcast {

/// State hashes of the newest ticks that a viewer decoded, at most `limit`. A tick has a state per stream,
/// and one more where a keyframe for a joiner tells it again; they are within the same bound, but differ in
/// their numbers.
class TickHashes {
 public:
  struct Key {
    uint64_t tick = 0;
    uint16_t stream_id = 0;
    uint32_t sequence = 0;  // of the frame in its stream
    auto operator<=>(const Key&) const = default;
  };

  explicit TickHashes(size_t limit) : limit_(limit) {}
  void add(const Key& key, uint64_t hash);
  std::optional<uint64_t> find(const Key& key) const;
  const std::map<Key, uint64_t>& hash_by_key() const { return hash_by_key_; }

 private:
  const size_t limit_;
  std::map<Key, uint64_t> hash_by_key_;
  std::deque<Key> order_;  // of arrival: ticks may begin again
};

/// Hashes kept of each viewer per frame to decode, because the first viewer continues while the second one
/// joins.
inline constexpr size_t kKeptTicksPerFrame = 4;

struct StreamCheck {
  std::string codec;             // of the first viewer's strands, at the end
  uint64_t decoded_frames = 0;   // by the first viewer
  uint64_t compared_ticks = 0;   // decoded by both, of the same stream
  uint64_t differing_ticks = 0;  // with different hashes
  uint64_t rejected_frames = 0;  // by either
  uint64_t first_differing_tick = 0;

  bool is_good() const { return compared_ticks > 0 && differing_ticks == 0 && rejected_frames == 0; }
  std::string to_string() const;
};

/// Decodes `frames` frames (at least 2). Returns errors of the connection, Timeout after `timeout_s`, or the
/// error that `config.cancel` returns.
Result<StreamCheck> check_stream(const ClientConfig& config, uint64_t frames, double timeout_s);

}  // namespace strandcast

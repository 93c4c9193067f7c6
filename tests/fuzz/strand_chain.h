// Plays a server that may be hostile against the decoder of one strand codec: honest frames of a chain in
// their order, with damaged and made-up messages between them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "common/strands/strand_codec.h"

namespace strandcast {

// The input: a byte of settings, then steps of a byte for the kind, a byte of flags and a piece (u16 length
// and bytes).
// Settings: bits 1 to 3 choose the size of the hair, bits 6 and 7 are 0 where it has slices.
inline constexpr uint8_t kWithRestShape = 1;

enum class ChainStep : uint8_t {
  Honest,   // the chain's next frame, or a keyframe when the decoder has left the chain; no piece is read
  Whole,    // the piece is the message
  Payload,  // the piece, behind a valid header
  Body,     // the piece, behind a valid header and fixed part
  Patched,  // the next honest frame, changed: the piece is u16 offset and a byte to XOR, repeated
  Spliced,  // the next honest frame up to a u16 offset, and the rest of the piece behind it
};
inline constexpr int kChainStepKinds = 6;

inline constexpr uint8_t kAsKeyframe = 1;  // flags: the valid header says keyframe, else delta
inline constexpr uint8_t kFixLength = 2;   // payload_bytes is corrected to what the message carries
inline constexpr uint8_t kKnowsHash = 4;   // a refused state hash is corrected, as a hostile server can

/// What decodes must be a valid snapshot, an honest frame must decode to exactly what it should, and after an
/// error the chain must go on as if nothing had come. Returns 0.
int fuzz_strand_chain(const std::string& codec, const uint8_t* data, size_t size);

/// Sees what games do with their decoders.
class StrandChainWatcher {
 public:
  virtual ~StrandChainWatcher() = default;
  virtual void made(const std::string& codec, const StrandStreamLimits& limits,
                    std::span<const glm::vec3> rest_in_head_m) = 0;
  virtual void decoded(std::span<const std::byte> message,
                       const Result<std::shared_ptr<const Snapshot>>& result) = 0;
};
/// Of all games from now on; nullptr = nobody watches. From one thread.
void watch_strand_chains(StrandChainWatcher* watcher);

}  // namespace strandcast

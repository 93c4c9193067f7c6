// Strand codecs: Snapshot <-> bytes. Encoder and decoder of a format live in one .cpp; codecs are rows of one
// table. Closed loop over integers, so decoding is bit-exact everywhere and nothing drifts. One encoder and
// one decoder per stream and thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/codec/frame_header.h"
#include "common/codec/snapshot.h"

namespace strandcast {

/// Encodes successive snapshots of one stream. The first is a keyframe.
class StrandEncoder {
 public:
  virtual ~StrandEncoder() = default;
  /// Appends `snapshot` to the chain. The result is a delta against the previous call (a keyframe the first
  /// time and whenever strand_count, vertex_count or quantum change). Null, with the chain restarted, when
  /// the frame would pass kMaxMediaPayloadBytes.
  virtual EncodedFramePtr encode(const Snapshot& snapshot) = 0;
  /// A keyframe for a late joiner at the chain's present state: after it, that client decodes the same deltas
  /// as everybody else. Does not disturb the chain. Null before the first encode() and above
  /// kMaxMediaPayloadBytes.
  virtual EncodedFramePtr encode_keyframe() = 0;
};

/// Decodes one stream. Input is untrusted: errors are returned, memory is bounded by the expected sizes.
class StrandDecoder {
 public:
  virtual ~StrandDecoder() = default;
  /// Decodes a keyframe or the delta that follows the last decoded frame. BadInput for malformed bytes;
  /// Unavailable when a delta's base is missing (ask for a keyframe). State is unchanged after an error.
  virtual Result<std::shared_ptr<const Snapshot>> decode(std::span<const std::byte> message) = 0;
};

/// What a decoder accepts: the sizes announced in the Welcome.
struct StrandStreamLimits {
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;
};

struct StrandCodecInfo {
  std::string name;     // "adaptive", "delta", "raw"
  std::string summary;  // one line
};

const std::vector<StrandCodecInfo>& strand_codecs();
/// NotFound names the known codecs.
Result<std::unique_ptr<StrandEncoder>> make_strand_encoder(const std::string& codec);
Result<std::unique_ptr<StrandDecoder>> make_strand_decoder(const std::string& codec,
                                                           const StrandStreamLimits& limits);

}  // namespace strandcast

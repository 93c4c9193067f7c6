// Strand codecs: Snapshot <-> bytes. Encoder and decoder of a format live in one .cpp; codecs are rows of one
// table. What is decoded is the same on every machine, bit for bit, lies within the announced bound, and
// nothing drifts. One encoder and one decoder per stream and thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/base/worker_pool.h"
#include "common/strands/frame_header.h"
#include "common/strands/snapshot.h"

namespace strandcast {

/// One state for those who follow the chain, and for those who join it.
struct JoinFrames {
  EncodedFramePtr frame;     // what everybody else needs
  EncodedFramePtr keyframe;  // of the same state and sequence: after it, all following deltas can be decoded
};

/// Encodes successive snapshots of one stream. The first is a keyframe.
class StrandEncoder {
 public:
  virtual ~StrandEncoder() = default;
  /// Rest shape in head space, (vertex_count x strand_count), strand fastest: what the asset tells viewers.
  /// Both sides must set the same one before the first frame, or none. Of all strands, also when the
  /// snapshots have only the first ones.
  virtual void set_rest_shape(std::span<const glm::vec3>) {}
  /// Appends `snapshot` to the chain. The result is a delta against the previous call (a keyframe the first
  /// time and whenever strand_count, vertex_count or quantum change). Null, with the chain restarted, when
  /// the frame would pass kMaxMediaPayloadBytes.
  virtual EncodedFramePtr encode(const Snapshot& snapshot) = 0;
  /// As encode(), with a keyframe for late joiners beside it: whoever decodes either one decodes the same
  /// deltas afterwards. Both are the same keyframe when the chain begins.
  virtual JoinFrames encode_for_join(const Snapshot& snapshot) = 0;
};

/// Decodes one stream, of all strands or of the first ones (strand_prefix.h): a keyframe says how many, and
/// the state hash is that of a snapshot with just those. Input is untrusted: errors are returned, memory is
/// bounded by the expected sizes.
class StrandDecoder {
 public:
  virtual ~StrandDecoder() = default;
  /// The encoder's counterpart; starts the decoder anew. From an untrusted asset: a shape of another size
  /// than announced counts as none.
  virtual void set_rest_shape(std::span<const glm::vec3>) {}
  /// Decodes a keyframe or the delta that follows the last decoded frame. BadInput for malformed bytes;
  /// Unavailable when a delta's base is missing (ask for a keyframe). State is unchanged after an error.
  virtual Result<std::shared_ptr<const Snapshot>> decode(std::span<const std::byte> message) = 0;
};

/// What a decoder accepts: the sizes announced in the Welcome.
struct StrandStreamLimits {
  uint32_t strand_count = 0;  // at most
  uint32_t vertex_count = 0;
};

/// How the bytes of deltas follow what a stream carries: an estimate for streams that nobody has measured.
/// Of a frame a part is as large however few strands it has: its header, and what it tells of the steps since
/// the last one. The rest, per second, goes with powers of the share of strands and of the rate.
struct StrandByteModel {
  double frame_bytes = 0.0;
  double step_bytes = 0.0;    // for every step that a frame tells of
  double share_power = 1.0;   // neighbours that are farther away say less
  double rate_power = 1.0;    // rarer frames are harder to predict
  double coarse_share = 1.0;  // of the rest at 0.5 mm instead of 0.1 mm
};

struct StrandCodecInfo {
  std::string name;     // "delta", "raw", "tangent"
  std::string summary;  // one line
  /// The decoder runs the simulation's own steps: only for viewers that can afford it, in builds with
  /// kernels.
  bool predicts = false;
  std::string fallback = {};  // codec for viewers that cannot decode this one; empty = none is needed
  double bytes_share = 1.0;   // of the fallback's bytes that it takes, as an estimate for people
  StrandByteModel bytes = {};
};

const std::vector<StrandCodecInfo>& strand_codecs();
/// NotFound names the known codecs.
Result<StrandCodecInfo> strand_codec_info(const std::string& codec);
/// Lattice step of the snapshots that a codec wants to stay within `bound_m` of the published positions: its
/// own lattice for "delta" and "raw", which change nothing, a much finer one for "tangent", which rounds
/// itself. `bound_m` is at least kMinBoundM. NotFound names the known codecs.
Result<float> lattice_step_m(const std::string& codec, float bound_m);
/// NotFound names the known codecs. How many `workers` there are changes no bit; they outlive the codec.
Result<std::unique_ptr<StrandEncoder>> make_strand_encoder(const std::string& codec,
                                                           WorkerPool& workers = shared_workers());
Result<std::unique_ptr<StrandDecoder>> make_strand_decoder(const std::string& codec,
                                                           const StrandStreamLimits& limits,
                                                           WorkerPool& workers = shared_workers());

}  // namespace strandcast

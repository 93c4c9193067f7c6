// Strand codecs: convert snapshots to bytes and back. Encoder and decoder of a format live in one .cpp file;
// codecs are rows of one table. Decoding gives the same bits on every machine, stays within the announced
// bound and does not drift. One encoder and one decoder per stream and thread.
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

// shared_strands.h
class SharedState;
struct SharedUpdate;

/// One state as two messages: for viewers that follow the chain and for viewers that join it.
struct JoinFrames {
  EncodedFramePtr frame;     // what everybody else needs
  EncodedFramePtr keyframe;  // of the same state and sequence: after it, all following deltas can be decoded
};

/// Which states of viewers an encoder hands over: those alone that keyframes tell, so that who has the stream
/// can take them over as well, or all.
enum class SharedStates { None, Told, All };

/// Encodes successive snapshots of one stream. The first is a keyframe.
class StrandEncoder {
 public:
  virtual ~StrandEncoder() = default;
  /// Sets the rest shape that the asset tells viewers: head space, (vertex_count x strand_count), strand
  /// fastest. It has all strands even if the snapshots hold only the first ones. Both sides must set the same
  /// shape before the first frame, or none.
  virtual void set_rest_shape(std::span<const glm::vec3>) {}
  /// Encodes `snapshot` as the next frame: a delta against the previous call. It is a keyframe the first time
  /// and when strand_count, vertex_count or quantum change. Returns null and restarts the chain if the frame
  /// would exceed kMaxMediaPayloadBytes.
  virtual EncodedFramePtr encode(const Snapshot& snapshot) = 0;
  /// Encodes like encode() and also makes a keyframe for late joiners. After either frame a decoder decodes
  /// the same deltas. When the chain begins, both are the same keyframe.
  virtual JoinFrames encode_for_join(const Snapshot& snapshot) = 0;
  /// Returns the state that viewers have after the last frame, unless steps of the state before, a tick a
  /// frame, lead to it as well. Nothing for codecs that do not predict by steps.
  virtual std::shared_ptr<SharedUpdate> take_shared(SharedStates = SharedStates::All) { return nullptr; }
  /// Tells the state of the strands in the next snapshot, where the simulation goes on from an update; null
  /// without one. The bytes are the same with and without it.
  virtual void set_state(std::shared_ptr<const SharedState>) {}
  /// Returns how many ticks were simulated here to predict frames, since the encoder was made.
  virtual uint64_t step_count() const { return 0; }
};

/// Decodes one stream of all strands or of the first ones (strand_prefix.h). A keyframe states their number;
/// the state hash covers only those. Input is untrusted: errors are returned, and the expected sizes bound
/// memory.
class StrandDecoder {
 public:
  virtual ~StrandDecoder() = default;
  /// Sets the encoder's rest shape and resets the decoder. The shape comes from an untrusted asset; one of
  /// unexpected size is ignored.
  virtual void set_rest_shape(std::span<const glm::vec3>) {}
  /// Decodes a keyframe, or the delta that follows the last decoded frame. BadInput for malformed bytes;
  /// Unavailable if a delta's base is missing, when the caller should request a keyframe. The state is
  /// unchanged after an error.
  virtual Result<std::shared_ptr<const Snapshot>> decode(std::span<const std::byte> message) = 0;
};

/// Largest sizes that a decoder accepts, as the Welcome announces them.
struct StrandStreamLimits {
  uint32_t strand_count = 0;  // at most
  uint32_t vertex_count = 0;
};

/// Estimates the bytes of deltas for streams that nobody has measured. A fixed part of each frame does not
/// depend on the number of strands: header and steps since the last frame. The remaining bytes per second
/// grow with powers of the share of strands and of the rate.
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
  /// Whether the decoder runs the simulation's own steps; only viewers with kernels and enough time can use
  /// it.
  bool predicts = false;
  std::string fallback = {};  // codec for viewers that cannot decode this one; empty = none is needed
  double bytes_share = 1.0;   // of the fallback's bytes that it takes, as an estimate for people
  StrandByteModel bytes = {};
};

const std::vector<StrandCodecInfo>& strand_codecs();
/// Returns a codec's properties. NotFound names the known codecs.
Result<StrandCodecInfo> strand_codec_info(const std::string& codec);
/// Returns the lattice step (m) of the snapshots that a codec needs to stay within `bound_m` (at least
/// kMinBoundM). "delta" and "raw" keep the lattice and use the bound's own step; "tangent" rounds itself and
/// needs a much finer one. NotFound names the known codecs.
Result<float> lattice_step_m(const std::string& codec, float bound_m);
/// Makes an encoder or decoder. `workers` must outlive it; their number changes no bit. NotFound names the
/// known codecs.
Result<std::unique_ptr<StrandEncoder>> make_strand_encoder(const std::string& codec,
                                                           WorkerPool& workers = shared_workers());
Result<std::unique_ptr<StrandDecoder>> make_strand_decoder(const std::string& codec,
                                                           const StrandStreamLimits& limits,
                                                           WorkerPool& workers = shared_workers());

}  // namespace strandcast

// StreamCodec: one codec of strands, ours or a general library's, as the streaming report runs it: a frame
// in, a message out, a frame back. Encoder and decoder are in one object but share only the message. One
// thread.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/kernels/step_model.h"
#include "common/strands/snapshot.h"

namespace strandcast {

/// What both sides know before the first frame.
struct StreamShape {
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;              // per strand
  std::vector<glm::vec3> rest_in_head_m;  // (vertex_count x strand_count) vertex-major, strand fastest
  size_t plane_size() const { return static_cast<size_t>(strand_count) * vertex_count; }
};

/// One recorded state.
struct StreamFrame {
  /// Complete copy of the published state without its lattice, which depends on codec and bound.
  Snapshot published;
  std::vector<glm::vec3> position_in_head_m;  // (vertex_count x strand_count) vertex-major, strand fastest
};

/// Returns the published state with its positions on a lattice of this step.
Snapshot on_lattice(const StreamFrame& frame, float quantum_m);

/// How much of the wind a codec knows that predicts by solver steps.
enum class WindTold {
  Known,   // all that the solver is
  Mean,    // the wind at the head, as it changes; not the waves that vary it over the head
  Unknown  // nothing
};
inline constexpr WindTold kWindsTold[] = {WindTold::Known, WindTold::Mean, WindTold::Unknown};
/// Returns "known", "mean" or "unknown".
const char* to_string(WindTold told);
/// Makes trails of one stream with only that much of the wind. While the scene stays the same, so does the
/// wind that is reported.
class ToldWind {
 public:
  explicit ToldWind(WindTold told) : told_(told) {}
  std::shared_ptr<const StepTrail> trail(const std::shared_ptr<const StepTrail>& whole);

 private:
  WindTold told_;
  std::shared_ptr<const StepScene> whole_scene_;
  std::shared_ptr<const StepScene> told_scene_;
};

class StreamCodec {
 public:
  virtual ~StreamCodec() = default;
  /// Converts the next frame to the encoder's input; not timed. `frame` must outlive the following encode().
  virtual Status take(const StreamFrame& frame) = 0;
  /// Encodes the taken frame into one message; frames depend on earlier ones.
  virtual Result<std::vector<std::byte>> encode() = 0;
  /// Decodes a message; messages must come in the order of encoding.
  virtual Status decode(std::span<const std::byte> message) = 0;
  /// Returns the result of the last decode(), (vertex_count x strand_count) as in StreamFrame; not timed.
  virtual std::vector<glm::vec3> decoded() const = 0;
  /// Returns the positions that the last take() encoded: the recording's, or those continued from the
  /// viewers' strands.
  virtual const std::vector<glm::vec3>& meant(const StreamFrame& frame) const {
    return frame.position_in_head_m;
  }
  /// Returns the bytes that a viewer joining at `frame` needs; ends the stream.
  virtual Result<size_t> join_bytes(const StreamFrame& frame) = 0;
};

/// A codec at one bound, as a row of the report.
struct StreamCodecRow {
  std::string name;  // "tangent", "zfp temporal"
  bool is_ours = false;
  bool is_temporal = false;    // uses the frames before
  double bound_m = 0.0;        // Euclidean, of every vertex
  bool is_bound_free = false;  // the same whatever the bound: bound_m is what it keeps by itself
  std::optional<WindTold> wind =
      {};  // of a codec that predicts by steps of the solver; others are told nothing
  std::function<Result<std::unique_ptr<StreamCodec>>(const StreamShape&)> make;
};

/// Returns every strand codec of the project at one bound; a codec that predicts by steps appears once for
/// each of kWindsTold.
std::vector<StreamCodecRow> own_stream_codecs(double bound_m);
inline constexpr const char* kExactCodec = "exact";
/// Returns "step" where the simulation goes on from its viewers' strands, so that frames are exact. It needs
/// a solver that viewers can step.
StreamCodecRow exact_stream_codec(double bound_m);

}  // namespace strandcast

// StrandClass: one way of coding the strand stream. Every class is encoded once for all viewers in it, and
// only while somebody is in it; a viewer whose link or machine is too slow moves to a cheaper one. Pure data,
// any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/strands/frame_header.h"
#include "common/strands/strand_codec.h"
#include "common/wire/messages.h"

namespace strandcast {

/// As relays are told of it.
using StrandClass = StreamList::Class;

/// Cheaper classes keep at least this rate,
inline constexpr double kLeastFrameRateHz = 10.0;
/// and at least so many strands: fewer no longer show how the hair between them moves.
inline constexpr uint32_t kLeastPrefixStrands = 120;
/// No class is coarser than this.
inline constexpr float kCoarsestBoundM = 5e-4f;

/// What the first class is to be.
struct StrandStreamPlan {
  double step_rate_hz = 60.0;
  double rate_hz = 0.0;  // at most; 0 = every step
  float bound_m = 1e-4f;
  uint32_t strand_count = 1;
};

/// The classes that strands are coded in, best first. First there are fewer strands, then the rate is
/// lowered, then the bound is coarser.
std::vector<StrandClass> make_strand_classes(const StrandStreamPlan& plan);

/// A class whose deltas have so many bytes.
struct MeasuredClass {
  const StrandClass& row;
  double delta_bytes = 0.0;
};
/// What another class of the same strands takes then, bytes/s, by an estimate.
double expected_bytes_per_s(const StrandByteModel& model, const MeasuredClass& measured,
                            const StrandClass& wanted);

/// Strands are served by the scene's codec, and maybe by a second one for viewers that cannot decode it. Each
/// has all classes, in streams of its own: those of the second begin here.
inline constexpr uint16_t kStreamsPerCodec = 256;
inline constexpr size_t kMaxServedCodecs = 2;
static_assert(kMaxServedCodecs * kStreamsPerCodec <= kPictureStreamBit);

/// One class by one of the codecs that are served.
struct StrandStream {
  size_t codec = 0;         // 0 = the scene's
  size_t strand_class = 0;  // below kStreamsPerCodec
};
constexpr uint16_t stream_id_of(const StrandStream& stream) {
  return static_cast<uint16_t>(stream.codec * kStreamsPerCodec + stream.strand_class);
}
constexpr StrandStream strand_stream_of(uint16_t stream_id) {
  return {stream_id / size_t{kStreamsPerCodec}, stream_id % size_t{kStreamsPerCodec}};
}

/// For a person: "1/4 of the strands, 30 Hz, 0.1 mm".
std::string to_string(const StrandClass& row);

}  // namespace strandcast

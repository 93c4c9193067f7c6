// StrandClass: one way of coding the strand stream. Each class is encoded once for all its viewers, and only
// while it has some; a viewer whose link or machine is too slow moves to a cheaper one. Pure data, any
// thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/strands/frame_header.h"
#include "common/strands/strand_codec.h"
#include "common/wire/messages.h"

namespace strandcast {

/// A class in the form in which relays receive it.
using StrandClass = StreamList::Class;

/// Lowest rate of cheaper classes.
inline constexpr double kLeastFrameRateHz = 10.0;
/// Lowest number of strands of cheaper classes; fewer no longer show how the hair between them moves.
inline constexpr uint32_t kLeastPrefixStrands = 120;
/// Coarsest bound of any class.
inline constexpr float kCoarsestBoundM = 5e-4f;

/// Requirements for the first class.
struct StrandStreamPlan {
  double step_rate_hz = 60.0;
  double rate_hz = 0.0;  // at most; 0 = every step
  float bound_m = 1e-4f;
  uint32_t strand_count = 1;
};

/// Returns the classes, best first. The number of strands falls first, then the rate, then the bound becomes
/// coarser.
std::vector<StrandClass> make_strand_classes(const StrandStreamPlan& plan);

/// A class with the measured size of its deltas.
struct MeasuredClass {
  const StrandClass& row;
  double delta_bytes = 0.0;
};
/// Estimates the bytes/s of another class of the same strands.
double expected_bytes_per_s(const StrandByteModel& model, const MeasuredClass& measured,
                            const StrandClass& wanted);

/// Offset between the stream ids of codecs. Strands are served by the scene's codec, and possibly by a second
/// one for viewers that cannot decode it; each has all classes.
inline constexpr uint16_t kStreamsPerCodec = 256;
inline constexpr size_t kMaxServedCodecs = 2;
static_assert(kMaxServedCodecs * kStreamsPerCodec <= kPictureStreamBit);

/// One class by one of the served codecs.
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

/// Describes a class for a person: "1/4 of the strands, 30 Hz, 0.1 mm".
std::string to_string(const StrandClass& row);

}  // namespace strandcast

// Picture: one rendered picture of a class, encoded once for all its viewers, who may hold different older
// ones. Immutable, any thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "common/base/picture_size.h"
#include "common/strands/frame_header.h"

namespace strandcast {

enum class PictureCodec : uint8_t { Jpeg, JpegTiles, Vp8, H264 };
inline constexpr std::array kPictureCodecs = {PictureCodec::Jpeg, PictureCodec::JpegTiles, PictureCodec::Vp8,
                                              PictureCodec::H264};

/// Whether pictures are coded as changes of the one before alone, at a given rate of bits.
constexpr bool is_video(PictureCodec codec) {
  return codec == PictureCodec::Vp8 || codec == PictureCodec::H264;
}

/// A set of codecs: bit (1 << codec). Whole JPEG pictures every client decodes, its bit says nothing.
using PictureCodecs = uint32_t;
constexpr PictureCodecs codec_bit(PictureCodec codec) {
  return 1u << static_cast<uint32_t>(codec);
}
inline constexpr PictureCodecs kAllPictureCodecs =
    codec_bit(PictureCodec::Jpeg) | codec_bit(PictureCodec::JpegTiles) | codec_bit(PictureCodec::Vp8) |
    codec_bit(PictureCodec::H264);
/// Those that this build decodes, and encodes on this machine.
PictureCodecs decodable_picture_codecs();
PictureCodecs encodable_picture_codecs();

/// "jpeg", "tiles", "vp8" or "h264".
const char* to_string(PictureCodec codec);

/// A state that was drawn, the first with a motion sample.
struct PictureMotion {
  int64_t sim_time_ns = 0;
  int64_t motion_time_ns = 0;  // server clock at the sample's arrival
  bool operator==(const PictureMotion&) const = default;
};
/// That are told at once.
inline constexpr uint32_t kMaxPictureMotions = 64;

class Picture {
 public:
  virtual ~Picture() = default;
  /// Counts the pictures of a class from 1; never 0.
  virtual uint32_t sequence() const = 0;
  /// Whether a viewer that shows picture `base` (0 = none) can be brought to this one.
  virtual bool can_follow(uint32_t base) const = 0;
  /// The message that does it. Null when can_follow() is false.
  virtual EncodedFramePtr after(uint32_t base) const = 0;
  /// The size of the message for a viewer that missed nothing.
  virtual size_t message_bytes() const = 0;
};
using PicturePtr = std::shared_ptr<const Picture>;

/// A picture that is one message for every viewer it can serve: any, or only those that show its base.
PicturePtr make_picture(EncodedFramePtr frame);

}  // namespace strandcast

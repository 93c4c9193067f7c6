// Picture: one rendered picture of a class, encoded once for all its viewers, who may hold different earlier
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

/// Returns whether the codec is video: pictures are differences from the preceding one, at a given bit rate.
constexpr bool is_video(PictureCodec codec) {
  return codec == PictureCodec::Vp8 || codec == PictureCodec::H264;
}

/// A set of codecs: bit (1 << codec). The bit of whole JPEG pictures has no meaning, because every client
/// decodes them.
using PictureCodecs = uint32_t;
constexpr PictureCodecs codec_bit(PictureCodec codec) {
  return 1u << static_cast<uint32_t>(codec);
}
inline constexpr PictureCodecs kAllPictureCodecs =
    codec_bit(PictureCodec::Jpeg) | codec_bit(PictureCodec::JpegTiles) | codec_bit(PictureCodec::Vp8) |
    codec_bit(PictureCodec::H264);
/// Codecs that this build decodes, and codecs that it encodes on this machine.
PictureCodecs decodable_picture_codecs();
PictureCodecs encodable_picture_codecs();

/// Returns "jpeg", "tiles", "vp8" or "h264".
const char* to_string(PictureCodec codec);

/// A drawn state that was the first with a new motion sample.
struct PictureMotion {
  int64_t sim_time_ns = 0;
  int64_t motion_time_ns = 0;  // server clock at the sample's arrival
  bool operator==(const PictureMotion&) const = default;
};
/// Largest number of motion samples reported at once.
inline constexpr uint32_t kMaxPictureMotions = 64;

class Picture {
 public:
  virtual ~Picture() = default;
  /// Returns the picture's number in its class, counted from 1; never 0.
  virtual uint32_t sequence() const = 0;
  /// Returns whether after(base) exists: an update for a viewer that shows picture `base` (0 = none).
  virtual bool can_follow(uint32_t base) const = 0;
  /// Returns the message that updates a viewer from picture `base` to this one; null if can_follow() is
  /// false.
  virtual EncodedFramePtr after(uint32_t base) const = 0;
  /// Returns the size of the message for a viewer that missed nothing.
  virtual size_t message_bytes() const = 0;
};
using PicturePtr = std::shared_ptr<const Picture>;

/// Makes a picture that is one message for all viewers it suits: every viewer, or those that show its base.
PicturePtr make_picture(EncodedFramePtr frame);

}  // namespace strandcast

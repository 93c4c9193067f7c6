// Video for pictures in motion: VP8 by libvpx, and H.264 by libavcodec if the build has it (STRANDCAST_H264).
// Encodes without lookahead and without periodic keyframes, on one thread, because more threads spin on a
// busy machine. Colours are BT.601 in studio range. Objects belong to one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/pictures/image_codec.h"
#include "common/pictures/picture.h"

namespace strandcast {

/// Returns the opcode of a codec's messages; opcodes of pictures have the order of the codecs.
constexpr Opcode opcode_of(PictureCodec codec) {
  return static_cast<Opcode>(static_cast<uint32_t>(Opcode::JpegFrame) + static_cast<uint32_t>(codec));
}

struct VideoConfig {
  uint32_t width = 0, height = 0;  // pixels, within the limits of pictures; of H.264 even
  double rate_hz = 15.0;           // of the pictures given to the encoder
  double bits_per_s = 1e6;         // on average; H.264 may stay below
};

enum class VideoFrame { Delta, Keyframe };
/// Rate of one frame: the target bit rate, or the finest quality at any size. For H.264, Finest gives a
/// keyframe.
enum class VideoRate { Target, Finest };

class VideoEncoder {
 public:
  virtual ~VideoEncoder() = default;

  /// Changes the bit rate from the next frame on, without a keyframe.
  void set_bits_per_s(double bits_per_s);
  /// Encodes a frame; the first is always a keyframe. BadInput for an image of another size. Never empty,
  /// since the encoder may not drop frames.
  Result<std::vector<std::byte>> encode(const Image& image, VideoFrame frame, VideoRate rate);

 protected:
  explicit VideoEncoder(const VideoConfig& config) : config_(config) {}
  const VideoConfig& config() const { return config_; }

 private:
  /// Encodes an image that has the size of config().
  virtual Result<std::vector<std::byte>> code(const Image& image, VideoFrame frame, VideoRate rate) = 0;

  VideoConfig config_;
};

/// Facts that a frame states before it is decoded.
struct VideoFrameInfo {
  bool is_keyframe = false;
  uint32_t width = 0, height = 0;  // of a keyframe, else 0
};

class VideoDecoder {
 public:
  virtual ~VideoDecoder() = default;

  PictureCodec codec() const { return codec_; }
  /// Decodes untrusted input, which read_video_info() must accept before the library sees it. A delta frame
  /// needs the preceding frame. After an error the next frame must be a keyframe.
  Result<Image> decode(std::span<const std::byte> frame);

 protected:
  explicit VideoDecoder(PictureCodec codec) : codec_(codec) {}

 private:
  /// Decodes a checked frame. `info` has the picture's size for delta frames too; a picture of another size
  /// is an error.
  virtual Result<Image> decode_checked(std::span<const std::byte> frame, const VideoFrameInfo& info) = 0;

  const PictureCodec codec_;
  uint32_t width_ = 0, height_ = 0;  // of the last keyframe; 0 = a keyframe is needed
};

/// Makes an encoder. BadInput for sizes or rates out of range and for codecs that are not video. Unsupported
/// if the build or its libavcodec has no encoder.
Result<std::unique_ptr<VideoEncoder>> make_video_encoder(PictureCodec codec, const VideoConfig& config);
/// Makes a decoder; Unsupported if the build has none.
Result<std::unique_ptr<VideoDecoder>> make_video_decoder(PictureCodec codec);
/// Reads an untrusted frame. BadInput for malformed frames, LimitExceeded beyond the picture sizes. For H.264
/// see h264_header.h.
Result<VideoFrameInfo> read_video_info(PictureCodec codec, std::span<const std::byte> frame);

}  // namespace strandcast

// Video for pictures in motion: VP8 by libvpx, and H.264 by libavcodec where the build has it
// (STRANDCAST_H264). One thread (more of them spin on a busy machine), no picture waits for a later one, no
// periodic keyframes. Colours are BT.601 in studio range. Objects belong to one thread.
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

/// Of the messages of a codec: the opcodes of pictures stand in the order of the codecs.
constexpr Opcode opcode_of(PictureCodec codec) {
  return static_cast<Opcode>(static_cast<uint32_t>(Opcode::JpegFrame) + static_cast<uint32_t>(codec));
}

struct VideoConfig {
  uint32_t width = 0, height = 0;  // pixels, within the limits of pictures; of H.264 even
  double rate_hz = 15.0;           // of the pictures given to the encoder
  double bits_per_s = 1e6;         // on average; H.264 may stay below
};

enum class VideoFrame { Delta, Keyframe };
/// Finest: as good as it gets, whatever it takes; of H.264 a keyframe.
enum class VideoRate { Target, Finest };

class VideoEncoder {
 public:
  virtual ~VideoEncoder() = default;

  /// From the next frame on, without a keyframe.
  void set_bits_per_s(double bits_per_s);
  /// The first frame is a keyframe, whatever is asked for. BadInput for an image of another size. Never
  /// empty: the encoder may not drop frames.
  Result<std::vector<std::byte>> encode(const Image& image, VideoFrame frame, VideoRate rate);

 protected:
  explicit VideoEncoder(const VideoConfig& config) : config_(config) {}
  const VideoConfig& config() const { return config_; }

 private:
  /// Of an image with the size of config().
  virtual Result<std::vector<std::byte>> code(const Image& image, VideoFrame frame, VideoRate rate) = 0;

  VideoConfig config_;
};

/// What a frame says before it is decoded.
struct VideoFrameInfo {
  bool is_keyframe = false;
  uint32_t width = 0, height = 0;  // of a keyframe, else 0
};

class VideoDecoder {
 public:
  virtual ~VideoDecoder() = default;

  PictureCodec codec() const { return codec_; }
  /// Untrusted input: read_video_info() passes it before a library sees a byte. A delta frame needs the frame
  /// before it. After an error only a keyframe helps.
  Result<Image> decode(std::span<const std::byte> frame);

 protected:
  explicit VideoDecoder(PictureCodec codec) : codec_(codec) {}

 private:
  /// `info` has the size of the picture for a delta frame too; any other picture is an error.
  virtual Result<Image> decode_checked(std::span<const std::byte> frame, const VideoFrameInfo& info) = 0;

  const PictureCodec codec_;
  uint32_t width_ = 0, height_ = 0;  // of the last keyframe; 0 = a keyframe is needed
};

/// BadInput for sizes and rates out of range and codecs that are no video, Unsupported where the build or its
/// libavcodec has no encoder.
Result<std::unique_ptr<VideoEncoder>> make_video_encoder(PictureCodec codec, const VideoConfig& config);
/// Unsupported where the build has none.
Result<std::unique_ptr<VideoDecoder>> make_video_decoder(PictureCodec codec);
/// Untrusted input. BadInput for what is no frame of the codec, LimitExceeded for sizes beyond those of
/// pictures; of H.264 see h264_header.h.
Result<VideoFrameInfo> read_video_info(PictureCodec codec, std::span<const std::byte> frame);

}  // namespace strandcast

// H.264 by libavcodec, where the build has it (STRANDCAST_H264): for live video, so no picture waits for a
// later one, one thread, no periodic keyframes. Colours are BT.601 in studio range. Objects belong to one
// thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/codec/h264_header.h"
#include "common/codec/image_codec.h"

namespace strandcast {

/// Whether this build decodes H.264.
bool has_h264_decoder();
/// Whether it also encodes: libavcodec has x264 and it starts. Tried once.
bool has_h264_encoder();

struct H264Config {
  uint32_t width = 0, height = 0;  // pixels, even, within the limits of pictures
  double rate_hz = 15.0;           // of the pictures given to the encoder
  double bits_per_s = 1e6;         // at most, on average
};

class H264Encoder {
 public:
  enum class Frame { Delta, Keyframe };
  enum class Rate { Target, Finest };  // Finest: as good as it gets, a keyframe

  /// x264. BadInput for sizes and rates out of range, Unsupported where libavcodec was built without it.
  static Result<H264Encoder> make(const H264Config& config);
  H264Encoder(H264Encoder&&) noexcept;
  H264Encoder& operator=(H264Encoder&&) noexcept;
  ~H264Encoder();

  /// From the next frame on, without a keyframe.
  void set_bits_per_s(double bits_per_s);
  /// The first frame is a keyframe, whatever is asked for. BadInput for an image of another size. Never
  /// empty.
  Result<std::vector<std::byte>> encode(const Image& image, Frame frame, Rate rate);

 private:
  struct State;
  explicit H264Encoder(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

class H264Decoder {
 public:
  /// Unsupported where the build has none.
  static Result<H264Decoder> make();
  H264Decoder(H264Decoder&&) noexcept;
  H264Decoder& operator=(H264Decoder&&) noexcept;
  ~H264Decoder();

  /// Untrusted input: read_h264_info() passes it before libavcodec sees a byte. A delta frame needs the frame
  /// before it. After an error only a keyframe helps.
  Result<Image> decode(std::span<const std::byte> frame);

 private:
  struct State;
  explicit H264Decoder(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace strandcast

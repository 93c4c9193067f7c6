// VP8 by libvpx, for pictures in motion: one thread (more of them spin on a busy machine), no periodic
// keyframes, rate control by the encoder. Colours are BT.601 in studio range, as VP8 decoders expect.
// Objects belong to one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/codec/image_codec.h"

namespace strandcast {

struct Vp8Config {
  uint32_t width = 0, height = 0;  // pixels, within the limits of pictures
  double rate_hz = 15.0;           // of the pictures given to the encoder
  double bits_per_s = 1e6;         // to be kept on average
};

class Vp8Encoder {
 public:
  enum class Frame { Delta, Keyframe };
  enum class Rate { Target, Finest };  // Finest: the lowest quantizer, whatever it takes

  /// BadInput for sizes and rates out of range.
  static Result<Vp8Encoder> make(const Vp8Config& config);
  Vp8Encoder(Vp8Encoder&&) noexcept;
  Vp8Encoder& operator=(Vp8Encoder&&) noexcept;
  ~Vp8Encoder();

  /// From the next frame on.
  void set_bits_per_s(double bits_per_s);
  /// The first frame is a keyframe, whatever is asked for. BadInput for an image of another size. Never
  /// empty: the encoder may not drop frames.
  Result<std::vector<std::byte>> encode(const Image& image, Frame frame, Rate rate);

 private:
  struct State;
  explicit Vp8Encoder(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// What the first bytes of a VP8 frame say (RFC 6386, section 9.1).
struct Vp8FrameInfo {
  bool is_keyframe = false;
  uint32_t width = 0, height = 0;  // of a keyframe, else 0
};
/// Untrusted input. BadInput for what is no VP8 frame, LimitExceeded for sizes beyond those of pictures.
Result<Vp8FrameInfo> read_vp8_info(std::span<const std::byte> frame);

class Vp8Decoder {
 public:
  static Result<Vp8Decoder> make();
  Vp8Decoder(Vp8Decoder&&) noexcept;
  Vp8Decoder& operator=(Vp8Decoder&&) noexcept;
  ~Vp8Decoder();

  /// Untrusted input: sizes are checked before libvpx sees a byte. A delta frame needs the frame before it.
  /// After an error only a keyframe helps.
  Result<Image> decode(std::span<const std::byte> frame);

 private:
  struct State;
  explicit Vp8Decoder(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace strandcast

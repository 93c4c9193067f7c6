// H.264 in a build without libavcodec: nothing is there, and that is said.
#include "common/codec/h264_codec.h"

namespace strandcast {
namespace {

Error no_h264() {
  return make_error(ErrorCode::Unsupported, "this build has no H.264 (CMake: -DSTRANDCAST_H264=ON)");
}

}  // namespace

struct H264Encoder::State {};
struct H264Decoder::State {};

bool has_h264_decoder() {
  return false;
}
bool has_h264_encoder() {
  return false;
}

H264Encoder::H264Encoder(std::unique_ptr<State> state) : state_(std::move(state)) {}
H264Encoder::H264Encoder(H264Encoder&&) noexcept = default;
H264Encoder& H264Encoder::operator=(H264Encoder&&) noexcept = default;
H264Encoder::~H264Encoder() = default;
Result<H264Encoder> H264Encoder::make(const H264Config&) {
  return no_h264();
}
void H264Encoder::set_bits_per_s(double) {}
Result<std::vector<std::byte>> H264Encoder::encode(const Image&, Frame, Rate) {
  return no_h264();
}

H264Decoder::H264Decoder(std::unique_ptr<State> state) : state_(std::move(state)) {}
H264Decoder::H264Decoder(H264Decoder&&) noexcept = default;
H264Decoder& H264Decoder::operator=(H264Decoder&&) noexcept = default;
H264Decoder::~H264Decoder() = default;
Result<H264Decoder> H264Decoder::make() {
  return no_h264();
}
Result<Image> H264Decoder::decode(std::span<const std::byte>) {
  return no_h264();
}

}  // namespace strandcast

#include "common/codec/h264_codec.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/opt.h>
}

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

#include "common/codec/image_check.h"
#include "common/codec/picture.h"
#include "common/codec/yuv_planes.h"

namespace strandcast {
namespace {

constexpr double kMinBitsPerS = 8e3;
constexpr double kMaxBitsPerS = 1e9;
constexpr double kMinRateHz = 0.01;
constexpr double kMaxRateHz = 1e3;
constexpr double kTicksPerS = 1000.0;
/// What an average second may borrow from the ones around it, as for VP8.
constexpr double kBufferS = 0.6;
constexpr int kNoKeyframes = 1 << 20;  // pictures between two
constexpr int kFinestQuantizer = 12;   // of 0..51
constexpr int64_t kUnlimitedBits = 1'000'000'000;
constexpr int64_t kMaxDecodedPixels = int64_t{kMaxPictureWidth + 16} * (kMaxPictureHeight + 16);

struct FreeContext {
  void operator()(AVCodecContext* context) const { avcodec_free_context(&context); }
};
using ContextPtr = std::unique_ptr<AVCodecContext, FreeContext>;
struct FreeFrame {
  void operator()(AVFrame* frame) const { av_frame_free(&frame); }
};
using FramePtr = std::unique_ptr<AVFrame, FreeFrame>;
struct FreePacket {
  void operator()(AVPacket* packet) const { av_packet_free(&packet); }
};
using PacketPtr = std::unique_ptr<AVPacket, FreePacket>;

/// x264's own: no picture waits for a later one, one slice, keyframes only when asked for, and a quality that
/// the rate caps.
constexpr const char* kEncoder = "libx264";
constexpr std::array<std::pair<const char*, const char*>, 5> kEncoderOptions = {
    {{"preset", "superfast"},
     {"tune", "zerolatency"},
     {"forced-idr", "1"},
     {"crf", "12"},
     {"x264-params", "keyint=infinite:scenecut=0:sliced-threads=0"}}};

Error av_error(const char* what, int code, ErrorCode kind) {
  std::array<char, AV_ERROR_MAX_STRING_SIZE> text{};
  av_strerror(code, text.data(), text.size());
  return make_error(kind, "{}: {}", what, text.data());
}

/// The library would print what hostile input makes it think.
void be_quiet() {
  static const bool is_quiet = [] {
    av_log_set_level(AV_LOG_QUIET);
    return true;
  }();
  (void)is_quiet;
}

YuvPlanes planes_of(const AVFrame& frame) {
  return {{frame.data[0], frame.linesize[0]},
          {frame.data[1], frame.linesize[1]},
          {frame.data[2], frame.linesize[2]}};
}

void set_rate(AVCodecContext& context, double bits_per_s, H264Encoder::Rate rate) {
  const bool is_finest = rate == H264Encoder::Rate::Finest;
  const int64_t bits =
      is_finest ? kUnlimitedBits : std::llround(std::clamp(bits_per_s, kMinBitsPerS, kMaxBitsPerS));
  context.rc_max_rate = bits;
  context.rc_buffer_size = static_cast<int>(static_cast<double>(bits) * kBufferS);
}

Result<ContextPtr> open_encoder(const H264Config& config, H264Encoder::Rate rate) {
  const AVCodec* codec = avcodec_find_encoder_by_name(kEncoder);
  if (codec == nullptr) return make_error(ErrorCode::Unsupported, "libavcodec has no {}", kEncoder);
  ContextPtr context(avcodec_alloc_context3(codec));
  if (!context) return make_error(ErrorCode::Internal, "no memory for an H.264 encoder");
  const double rate_hz = std::clamp(config.rate_hz, kMinRateHz, kMaxRateHz);
  context->width = static_cast<int>(config.width);
  context->height = static_cast<int>(config.height);
  context->pix_fmt = AV_PIX_FMT_YUV420P;
  context->framerate = {static_cast<int>(std::lround(rate_hz * kTicksPerS)), static_cast<int>(kTicksPerS)};
  context->time_base = av_inv_q(context->framerate);
  context->gop_size = kNoKeyframes;
  context->max_b_frames = 0;
  context->refs = 1;
  context->thread_count = 1;
  context->flags |= AV_CODEC_FLAG_LOW_DELAY;
  context->color_range = AVCOL_RANGE_MPEG;
  context->colorspace = AVCOL_SPC_SMPTE170M;
  context->qmin = kFinestQuantizer;
  set_rate(*context, config.bits_per_s, rate);
  AVDictionary* options = nullptr;
  for (const auto& [key, value] : kEncoderOptions) av_dict_set(&options, key, value, 0);
  const int opened = avcodec_open2(context.get(), codec, &options);
  av_dict_free(&options);
  if (opened < 0) return av_error(kEncoder, opened, ErrorCode::Unsupported);
  return context;
}

}  // namespace

struct H264Encoder::State {
  H264Config config;
  ContextPtr context;
  FramePtr frame;
  PacketPtr packet;
};

bool has_h264_decoder() {
  return avcodec_find_decoder(AV_CODEC_ID_H264) != nullptr;
}

bool has_h264_encoder() {
  static const bool is_there = H264Encoder::make({640, 360, 15.0, 1e6}).ok();
  return is_there;
}

H264Encoder::H264Encoder(std::unique_ptr<State> state) : state_(std::move(state)) {}
H264Encoder::H264Encoder(H264Encoder&&) noexcept = default;
H264Encoder& H264Encoder::operator=(H264Encoder&&) noexcept = default;
H264Encoder::~H264Encoder() = default;

Result<H264Encoder> H264Encoder::make(const H264Config& config) {
  be_quiet();
  const bool is_even = config.width % 2 == 0 && config.height % 2 == 0;
  if (!is_even || config.width < kMinPictureSide || config.height < kMinPictureSide ||
      config.width > kMaxPictureWidth || config.height > kMaxPictureHeight)
    return make_error(ErrorCode::BadInput,
                      "H.264 pictures of {} x {}, allowed are even sizes of {} to {} x {}", config.width,
                      config.height, kMinPictureSide, kMaxPictureWidth, kMaxPictureHeight);
  if (!(config.rate_hz > 0.0) || !(config.bits_per_s > 0.0))
    return make_error(ErrorCode::BadInput, "H.264 at {} Hz and {} bit/s", config.rate_hz, config.bits_per_s);
  auto state = std::make_unique<State>();
  state->config = config;
  ASSIGN_OR_RETURN(state->context, open_encoder(config, Rate::Target));
  state->packet.reset(av_packet_alloc());
  state->frame.reset(av_frame_alloc());
  if (!state->packet || !state->frame)
    return make_error(ErrorCode::Internal, "no memory for an H.264 picture");
  AVFrame& frame = *state->frame;
  frame.format = AV_PIX_FMT_YUV420P;
  frame.width = static_cast<int>(config.width);
  frame.height = static_cast<int>(config.height);
  frame.pts = 0;
  if (const int made = av_frame_get_buffer(&frame, 0); made < 0)
    return av_error("no memory for an H.264 picture", made, ErrorCode::Internal);
  return H264Encoder(std::move(state));
}

void H264Encoder::set_bits_per_s(double bits_per_s) {
  state_->config.bits_per_s = bits_per_s;
}

Result<std::vector<std::byte>> H264Encoder::encode(const Image& image, Frame frame, Rate rate) {
  RETURN_IF_ERROR(check_image(image));
  State& state = *state_;
  if (image.width != state.config.width || image.height != state.config.height)
    return make_error(ErrorCode::BadInput, "a picture of {} x {} for an H.264 stream of {} x {}", image.width,
                      image.height, state.config.width, state.config.height);
  if (rate == Rate::Finest) {
    // x264 would fill its empty buffer at the higher rate only after this picture.
    ASSIGN_OR_RETURN(state.context, open_encoder(state.config, rate));
  } else {
    set_rate(*state.context, state.config.bits_per_s, rate);  // x264 looks whether it is another one
  }
  AVFrame& picture = *state.frame;
  if (const int ready = av_frame_make_writable(&picture); ready < 0)
    return av_error("no memory for an H.264 picture", ready, ErrorCode::Internal);
  fill_planes(image, planes_of(picture));
  picture.pict_type = frame == Frame::Keyframe ? AV_PICTURE_TYPE_I : AV_PICTURE_TYPE_NONE;
  ++picture.pts;
  int done = avcodec_send_frame(state.context.get(), &picture);
  if (done >= 0) done = avcodec_receive_packet(state.context.get(), state.packet.get());
  if (done < 0) return av_error("cannot encode H.264", done, ErrorCode::Internal);
  const auto* begin = reinterpret_cast<const std::byte*>(state.packet->data);
  std::vector<std::byte> bytes(begin, begin + state.packet->size);
  av_packet_unref(state.packet.get());
  return bytes;
}

struct H264Decoder::State {
  ContextPtr context;  // null: a keyframe starts anew
  FramePtr frame;
  PacketPtr packet;
  uint32_t width = 0, height = 0;  // of the last keyframe
};

H264Decoder::H264Decoder(std::unique_ptr<State> state) : state_(std::move(state)) {}
H264Decoder::H264Decoder(H264Decoder&&) noexcept = default;
H264Decoder& H264Decoder::operator=(H264Decoder&&) noexcept = default;
H264Decoder::~H264Decoder() = default;

namespace {

Result<ContextPtr> open_decoder() {
  const AVCodec* codec = avcodec_find_decoder(AV_CODEC_ID_H264);
  ContextPtr context(codec != nullptr ? avcodec_alloc_context3(codec) : nullptr);
  if (!context) return make_error(ErrorCode::Unsupported, "libavcodec has no H.264 decoder");
  context->thread_count = 1;
  context->flags |= AV_CODEC_FLAG_LOW_DELAY;
  context->max_pixels = kMaxDecodedPixels;
  context->error_concealment = FF_EC_FAVOR_INTER;  // anything but 0, or parts that are missing go unnoticed
  context->err_recognition = AV_EF_EXPLODE | AV_EF_BITSTREAM | AV_EF_BUFFER;
  if (const int opened = avcodec_open2(context.get(), codec, nullptr); opened < 0)
    return av_error("cannot start the H.264 decoder", opened, ErrorCode::Internal);
  return context;
}

}  // namespace

Result<H264Decoder> H264Decoder::make() {
  be_quiet();
  auto state = std::make_unique<State>();
  state->packet.reset(av_packet_alloc());
  state->frame.reset(av_frame_alloc());
  if (!state->packet || !state->frame)
    return make_error(ErrorCode::Internal, "no memory for an H.264 picture");
  return H264Decoder(std::move(state));
}

Result<Image> H264Decoder::decode(std::span<const std::byte> frame) {
  State& state = *state_;
  ASSIGN_OR_RETURN(const H264FrameInfo info, read_h264_info(frame));
  if (info.is_keyframe) {
    // Nothing of before: a keyframe mends everything, and no more pictures are kept than one stream needs.
    ASSIGN_OR_RETURN(state.context, open_decoder());
    state.width = info.width;
    state.height = info.height;
  } else if (!state.context) {
    return make_error(ErrorCode::BadInput, "an H.264 delta frame without the frame before it");
  }
  ContextPtr context = std::move(state.context);  // back when it has decoded this one
  AVPacket& packet = *state.packet;
  av_packet_unref(&packet);
  if (const int made = av_new_packet(&packet, static_cast<int>(frame.size())); made < 0)
    return av_error("no memory for an H.264 frame", made, ErrorCode::Internal);
  std::memcpy(packet.data, frame.data(), frame.size());
  int done = avcodec_send_packet(context.get(), &packet);
  if (done >= 0) done = avcodec_receive_frame(context.get(), state.frame.get());
  if (done < 0) return av_error("damaged H.264 frame", done, ErrorCode::BadInput);
  const AVFrame& picture = *state.frame;
  const bool is_whole = picture.decode_error_flags == 0 && (picture.flags & AV_FRAME_FLAG_CORRUPT) == 0;
  const bool is_plain = picture.format == AV_PIX_FMT_YUV420P || picture.format == AV_PIX_FMT_YUVJ420P;
  if (!is_whole || !is_plain || picture.width != static_cast<int>(state.width) ||
      picture.height != static_cast<int>(state.height))
    return make_error(ErrorCode::BadInput, "an H.264 frame of {} bytes gives no picture of {} x {}",
                      frame.size(), state.width, state.height);
  Image image = make_image(planes_of(picture), state.width, state.height);
  av_frame_unref(state.frame.get());
  state.context = std::move(context);
  return image;
}

}  // namespace strandcast

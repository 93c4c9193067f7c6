#include "common/codec/vp8_codec.h"

#include <vpx/vp8cx.h>
#include <vpx/vp8dx.h>
#include <vpx/vpx_decoder.h>
#include <vpx/vpx_encoder.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/codec/image_check.h"
#include "common/codec/picture.h"
#include "common/codec/yuv_planes.h"

namespace strandcast {
namespace {

constexpr int kCpuUsed = -12;             // negative: a fixed speed, not one that follows the load
constexpr uint32_t kFinestQuantizer = 4;  // of 0..63
constexpr uint32_t kCoarsestQuantizer = 63;
constexpr double kMinBitsPerS = 8e3;
constexpr double kMaxBitsPerS = 1e9;
constexpr double kMinRateHz = 0.01;
constexpr double kMaxRateHz = 1e3;
constexpr double kTicksPerS = 1000.0;
/// What a keyframe may take, in percent of what an average frame does; about what it needs to look alike.
constexpr uint32_t kKeyframePercent = 500;
constexpr unsigned kBufferMs = 600, kBufferInitialMs = 400, kBufferOptimalMs = 500;
constexpr size_t kTagBytes = 3;
constexpr size_t kKeyframeTagBytes = 10;

struct EndCodec {
  void operator()(vpx_codec_ctx_t* codec) const {
    vpx_codec_destroy(codec);
    delete codec;
  }
};
using CodecPtr = std::unique_ptr<vpx_codec_ctx_t, EndCodec>;

struct FreePlanes {
  void operator()(vpx_image_t* planes) const { vpx_img_free(planes); }
};

YuvPlanes planes_of(const vpx_image_t& image) {
  return {{image.planes[VPX_PLANE_Y], image.stride[VPX_PLANE_Y]},
          {image.planes[VPX_PLANE_U], image.stride[VPX_PLANE_U]},
          {image.planes[VPX_PLANE_V], image.stride[VPX_PLANE_V]}};
}

unsigned kilobits(double bits_per_s) {
  return static_cast<unsigned>(std::lround(std::clamp(bits_per_s, kMinBitsPerS, kMaxBitsPerS) / 1e3));
}

Error vpx_error(const char* what, vpx_codec_ctx_t* codec, ErrorCode code) {
  const char* detail = vpx_codec_error_detail(codec);
  return make_error(code, "{}: {}{}{}", what, vpx_codec_error(codec), detail != nullptr ? ", " : "",
                    detail != nullptr ? detail : "");
}

}  // namespace

struct Vp8Encoder::State {
  vpx_codec_enc_cfg_t config{};
  CodecPtr codec;
  std::unique_ptr<vpx_image_t, FreePlanes> planes;
  Rate rate = Rate::Target;
  bool has_new_config = false;
  int64_t frame_ticks = 0;
  int64_t time_ticks = 0;
};

Vp8Encoder::Vp8Encoder(std::unique_ptr<State> state) : state_(std::move(state)) {}
Vp8Encoder::Vp8Encoder(Vp8Encoder&&) noexcept = default;
Vp8Encoder& Vp8Encoder::operator=(Vp8Encoder&&) noexcept = default;
Vp8Encoder::~Vp8Encoder() = default;

Result<Vp8Encoder> Vp8Encoder::make(const Vp8Config& config) {
  if (config.width < kMinPictureSide || config.height < kMinPictureSide || config.width > kMaxPictureWidth ||
      config.height > kMaxPictureHeight)
    return make_error(ErrorCode::BadInput, "VP8 pictures of {} x {}, allowed are {} to {} x {}", config.width,
                      config.height, kMinPictureSide, kMaxPictureWidth, kMaxPictureHeight);
  if (!(config.rate_hz > 0.0) || !(config.bits_per_s > 0.0))
    return make_error(ErrorCode::BadInput, "VP8 at {} Hz and {} bit/s", config.rate_hz, config.bits_per_s);
  auto state = std::make_unique<State>();
  vpx_codec_enc_cfg_t& vpx = state->config;
  if (vpx_codec_enc_config_default(vpx_codec_vp8_cx(), &vpx, 0) != VPX_CODEC_OK)
    return make_error(ErrorCode::Internal, "libvpx has no VP8 encoder");
  vpx.g_w = config.width;
  vpx.g_h = config.height;
  vpx.g_threads = 1;
  vpx.g_timebase = {1, static_cast<int>(kTicksPerS)};
  vpx.g_pass = VPX_RC_ONE_PASS;
  vpx.g_lag_in_frames = 0;
  vpx.g_error_resilient = 0;
  vpx.kf_mode = VPX_KF_DISABLED;
  vpx.rc_end_usage = VPX_CBR;
  vpx.rc_dropframe_thresh = 0;
  vpx.rc_resize_allowed = 0;
  vpx.rc_target_bitrate = kilobits(config.bits_per_s);
  vpx.rc_min_quantizer = kFinestQuantizer;
  vpx.rc_max_quantizer = kCoarsestQuantizer;
  vpx.rc_buf_sz = kBufferMs;
  vpx.rc_buf_initial_sz = kBufferInitialMs;
  vpx.rc_buf_optimal_sz = kBufferOptimalMs;
  const double rate_hz = std::clamp(config.rate_hz, kMinRateHz, kMaxRateHz);
  state->frame_ticks = std::max<int64_t>(std::llround(kTicksPerS / rate_hz), 1);
  auto codec = std::make_unique<vpx_codec_ctx_t>();
  if (vpx_codec_enc_init(codec.get(), vpx_codec_vp8_cx(), &vpx, 0) != VPX_CODEC_OK)
    return vpx_error("cannot start the VP8 encoder", codec.get(), ErrorCode::Internal);
  state->codec.reset(codec.release());
  vpx_codec_ctx_t* running = state->codec.get();
  const bool is_set =
      vpx_codec_control(running, VP8E_SET_CPUUSED, kCpuUsed) == VPX_CODEC_OK &&
      vpx_codec_control(running, VP8E_SET_MAX_INTRA_BITRATE_PCT, kKeyframePercent) == VPX_CODEC_OK &&
      vpx_codec_control(running, VP8E_SET_STATIC_THRESHOLD, 1u) == VPX_CODEC_OK;
  if (!is_set) return vpx_error("cannot set up the VP8 encoder", running, ErrorCode::Internal);
  state->planes.reset(vpx_img_alloc(nullptr, VPX_IMG_FMT_I420, config.width, config.height, 16));
  if (!state->planes) return make_error(ErrorCode::Internal, "no memory for a VP8 picture");
  return Vp8Encoder(std::move(state));
}

void Vp8Encoder::set_bits_per_s(double bits_per_s) {
  const unsigned target = kilobits(bits_per_s);
  state_->has_new_config |= target != state_->config.rc_target_bitrate;
  state_->config.rc_target_bitrate = target;
}

Result<std::vector<std::byte>> Vp8Encoder::encode(const Image& image, Frame frame, Rate rate) {
  RETURN_IF_ERROR(check_image(image));
  State& state = *state_;
  if (image.width != state.config.g_w || image.height != state.config.g_h)
    return make_error(ErrorCode::BadInput, "a picture of {} x {} for a VP8 stream of {} x {}", image.width,
                      image.height, state.config.g_w, state.config.g_h);
  vpx_image_t& planes = *state.planes;
  fill_planes(image, planes_of(planes));
  if (rate != state.rate || state.has_new_config) {
    state.config.rc_max_quantizer = rate == Rate::Finest ? kFinestQuantizer : kCoarsestQuantizer;
    if (vpx_codec_enc_config_set(state.codec.get(), &state.config) != VPX_CODEC_OK)
      return vpx_error("cannot change the VP8 encoder", state.codec.get(), ErrorCode::Internal);
    state.rate = rate;
    state.has_new_config = false;
  }
  const vpx_enc_frame_flags_t flags = frame == Frame::Keyframe ? VPX_EFLAG_FORCE_KF : 0;
  if (vpx_codec_encode(state.codec.get(), &planes, state.time_ticks,
                       static_cast<unsigned long>(state.frame_ticks), flags, VPX_DL_REALTIME) != VPX_CODEC_OK)
    return vpx_error("cannot encode VP8", state.codec.get(), ErrorCode::Internal);
  state.time_ticks += state.frame_ticks;
  std::vector<std::byte> bytes;
  vpx_codec_iter_t iterator = nullptr;
  while (const vpx_codec_cx_pkt_t* packet = vpx_codec_get_cx_data(state.codec.get(), &iterator)) {
    if (packet->kind != VPX_CODEC_CX_FRAME_PKT) continue;
    const auto* begin = static_cast<const std::byte*>(packet->data.frame.buf);
    bytes.insert(bytes.end(), begin, begin + packet->data.frame.sz);
  }
  if (bytes.empty()) return make_error(ErrorCode::Internal, "the VP8 encoder dropped a picture");
  return bytes;
}

Result<Vp8FrameInfo> read_vp8_info(std::span<const std::byte> frame) {
  if (frame.size() < kTagBytes)
    return make_error(ErrorCode::BadInput, "a VP8 frame of {} bytes has no tag", frame.size());
  const auto byte = [&](size_t i) { return std::to_integer<uint32_t>(frame[i]); };
  Vp8FrameInfo info;
  info.is_keyframe = (byte(0) & 1) == 0;
  const uint32_t tag = byte(0) | byte(1) << 8 | byte(2) << 16;
  const size_t first_part_bytes = tag >> 5;
  const size_t header_bytes = info.is_keyframe ? kKeyframeTagBytes : kTagBytes;
  if (frame.size() < header_bytes || first_part_bytes > frame.size() - header_bytes)
    return make_error(ErrorCode::BadInput, "a VP8 frame of {} bytes announces {} in its first part",
                      frame.size(), first_part_bytes);
  if (!info.is_keyframe) return info;
  if (byte(3) != 0x9d || byte(4) != 0x01 || byte(5) != 0x2a)
    return make_error(ErrorCode::BadInput, "a VP8 keyframe without its start code");
  // The two bits above each size ask for scaling, which nobody here does.
  info.width = byte(6) | byte(7) << 8;
  info.height = byte(8) | byte(9) << 8;
  if (info.width < kMinPictureSide || info.height < kMinPictureSide || info.width > kMaxPictureWidth ||
      info.height > kMaxPictureHeight)
    return make_error(ErrorCode::LimitExceeded, "a VP8 picture of {} x {}, allowed are {} to {} x {}",
                      info.width, info.height, kMinPictureSide, kMaxPictureWidth, kMaxPictureHeight);
  return info;
}

struct Vp8Decoder::State {
  CodecPtr codec;
  uint32_t width = 0, height = 0;  // of the last keyframe; 0 = a keyframe is needed
};

Vp8Decoder::Vp8Decoder(std::unique_ptr<State> state) : state_(std::move(state)) {}
Vp8Decoder::Vp8Decoder(Vp8Decoder&&) noexcept = default;
Vp8Decoder& Vp8Decoder::operator=(Vp8Decoder&&) noexcept = default;
Vp8Decoder::~Vp8Decoder() = default;

Result<Vp8Decoder> Vp8Decoder::make() {
  vpx_codec_dec_cfg_t config{};
  config.threads = 1;
  auto codec = std::make_unique<vpx_codec_ctx_t>();
  if (vpx_codec_dec_init(codec.get(), vpx_codec_vp8_dx(), &config, 0) != VPX_CODEC_OK)
    return vpx_error("cannot start the VP8 decoder", codec.get(), ErrorCode::Internal);
  auto state = std::make_unique<State>();
  state->codec.reset(codec.release());
  return Vp8Decoder(std::move(state));
}

Result<Image> Vp8Decoder::decode(std::span<const std::byte> frame) {
  State& state = *state_;
  ASSIGN_OR_RETURN(const Vp8FrameInfo info, read_vp8_info(frame));
  if (!info.is_keyframe && state.width == 0)
    return make_error(ErrorCode::BadInput, "a VP8 delta frame without the frame before it");
  const uint32_t width = info.is_keyframe ? info.width : state.width;
  const uint32_t height = info.is_keyframe ? info.height : state.height;
  state.width = 0;  // until this one is decoded
  const auto* data = reinterpret_cast<const uint8_t*>(frame.data());
  if (vpx_codec_decode(state.codec.get(), data, static_cast<unsigned>(frame.size()), nullptr, 0) !=
      VPX_CODEC_OK)
    return vpx_error("damaged VP8 frame", state.codec.get(), ErrorCode::BadInput);
  int corrupted = 0;
  (void)vpx_codec_control(state.codec.get(), VP8D_GET_FRAME_CORRUPTED, &corrupted);
  vpx_codec_iter_t iterator = nullptr;
  const vpx_image_t* planes = vpx_codec_get_frame(state.codec.get(), &iterator);
  if (corrupted != 0 || planes == nullptr || planes->fmt != VPX_IMG_FMT_I420 || planes->d_w != width ||
      planes->d_h != height)
    return make_error(ErrorCode::BadInput, "a VP8 frame of {} bytes gives no picture of {} x {}",
                      frame.size(), width, height);
  Image image = make_image(planes_of(*planes), width, height);
  state.width = width;
  state.height = height;
  return image;
}

}  // namespace strandcast

// VP8 by libvpx.
#include <vpx/vp8cx.h>
#include <vpx/vp8dx.h>
#include <vpx/vpx_decoder.h>
#include <vpx/vpx_encoder.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/pictures/image_check.h"
#include "common/pictures/video_rows.h"
#include "common/pictures/yuv_planes.h"

namespace strandcast {
namespace {

constexpr int kCpuUsed = -12;                // negative: a fixed speed, not one that follows the load
constexpr uint32_t kFinestVp8Quantizer = 4;  // of 0..63
constexpr uint32_t kCoarsestQuantizer = 63;
constexpr uint32_t kFirstQuantizer = 30;
constexpr double kVp8TicksPerS = 1000.0;
/// What a keyframe may take, in percent of what an average frame does; about what it needs to look alike.
constexpr uint32_t kKeyframePercent = 500;
// libvpx guesses quantizers from pictures that are harder than hair before a plain ground. Its keyframes take
// a tenth of what they may, and it needs ten pictures to learn that. So keyframes are encoded up to three
// times until one fits, and the coarsest quantizer of the next picture follows the bytes of the last one.
constexpr int kKeyframeTries = 3;
constexpr double kLeastBudget = 0.25;        // of an average picture's bytes, while a debt is paid back
constexpr double kKeyframeFill = 0.7;        // of what it may take: near enough
constexpr double kQuantizersPerHalf = 11.0;  // steps of the quantizer by which the bytes of a picture halve
constexpr auto kBufferMs = static_cast<unsigned>(1e3 * kVideoBufferS);
constexpr unsigned kBufferInitialMs = 400, kBufferOptimalMs = 500;
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
  return static_cast<unsigned>(std::lround(bits_per_s / 1e3));
}

Error vpx_error(const char* what, vpx_codec_ctx_t* codec, ErrorCode code) {
  const char* detail = vpx_codec_error_detail(codec);
  return make_error(code, "{}: {}{}{}", what, vpx_codec_error(codec), detail != nullptr ? ", " : "",
                    detail != nullptr ? detail : "");
}

class Vp8Encoder : public VideoEncoder {
 public:
  explicit Vp8Encoder(const VideoConfig& config)
      : VideoEncoder(config),
        frame_ticks_(std::max<int64_t>(std::llround(kVp8TicksPerS / config.rate_hz), 1)) {}

  Status start() {
    if (vpx_codec_enc_config_default(vpx_codec_vp8_cx(), &vpx_, 0) != VPX_CODEC_OK)
      return make_error(ErrorCode::Internal, "libvpx has no VP8 encoder");
    vpx_.g_w = config().width;
    vpx_.g_h = config().height;
    vpx_.g_threads = 1;
    vpx_.g_timebase = {1, static_cast<int>(kVp8TicksPerS)};
    vpx_.g_pass = VPX_RC_ONE_PASS;
    vpx_.g_lag_in_frames = 0;
    vpx_.g_error_resilient = 0;
    vpx_.kf_mode = VPX_KF_DISABLED;
    vpx_.rc_end_usage = VPX_CBR;
    vpx_.rc_dropframe_thresh = 0;
    vpx_.rc_resize_allowed = 0;
    vpx_.rc_target_bitrate = kilobits(config().bits_per_s);
    vpx_.rc_min_quantizer = kFinestVp8Quantizer;
    vpx_.rc_max_quantizer = kCoarsestQuantizer;
    vpx_.rc_buf_sz = kBufferMs;
    vpx_.rc_buf_initial_sz = kBufferInitialMs;
    vpx_.rc_buf_optimal_sz = kBufferOptimalMs;
    auto codec = std::make_unique<vpx_codec_ctx_t>();
    if (vpx_codec_enc_init(codec.get(), vpx_codec_vp8_cx(), &vpx_, 0) != VPX_CODEC_OK)
      return vpx_error("cannot start the VP8 encoder", codec.get(), ErrorCode::Internal);
    codec_.reset(codec.release());
    const bool is_set =
        vpx_codec_control(codec_.get(), VP8E_SET_CPUUSED, kCpuUsed) == VPX_CODEC_OK &&
        vpx_codec_control(codec_.get(), VP8E_SET_MAX_INTRA_BITRATE_PCT, kKeyframePercent) == VPX_CODEC_OK &&
        vpx_codec_control(codec_.get(), VP8E_SET_STATIC_THRESHOLD, 1u) == VPX_CODEC_OK;
    if (!is_set) return vpx_error("cannot set up the VP8 encoder", codec_.get(), ErrorCode::Internal);
    planes_.reset(vpx_img_alloc(nullptr, VPX_IMG_FMT_I420, config().width, config().height, 16));
    if (!planes_) return make_error(ErrorCode::Internal, "no memory for a VP8 picture");
    return {};
  }

 private:
  Result<std::vector<std::byte>> code(const Image& image, VideoFrame frame, VideoRate rate) override {
    fill_planes(image, planes_of(*planes_));
    if (frame == VideoFrame::Keyframe && rate == VideoRate::Target) return code_keyframe();
    const uint32_t coarsest = rate == VideoRate::Finest ? kFinestVp8Quantizer : next_coarsest();
    RETURN_IF_ERROR(set_rate({kFinestVp8Quantizer, coarsest}));
    return code_planes(frame);
  }

  double average_bytes() const { return config().bits_per_s / config().rate_hz / 8.0; }

  /// Returns the quantizer at which the next picture takes an average one's bytes, less what the last ones
  /// took too much.
  uint32_t next_coarsest() const {
    const double average = average_bytes();
    const double pictures_in_buffer = std::max(kVideoBufferS * config().rate_hz, 1.0);
    const double budget = std::max(average - debt_bytes_ / pictures_in_buffer, kLeastBudget * average);
    // Not finer than the last keyframe: a picture that changes as a whole would take more than that.
    return std::max(coarser(last_quantizer_, last_bytes_ / budget), keyframe_quantizer_);
  }

  /// Returns the quantizer of pictures of 1 / `share` of the bytes.
  static uint32_t coarser(uint32_t quantizer, double share) {
    const double wanted = quantizer + kQuantizersPerHalf * std::log2(std::max(share, 1e-3));
    return static_cast<uint32_t>(
        std::clamp(std::lround(wanted), long{kFinestVp8Quantizer}, long{kCoarsestQuantizer}));
  }

  Result<std::vector<std::byte>> code_keyframe() {
    const double budget_bytes = average_bytes() * kKeyframePercent / 100.0;
    for (int i = 1;; ++i) {
      const uint32_t quantizer = keyframe_quantizer_;
      RETURN_IF_ERROR(set_rate({quantizer, quantizer}));
      ASSIGN_OR_RETURN(std::vector<std::byte> bytes, code_planes(VideoFrame::Keyframe));
      const double share = static_cast<double>(bytes.size()) / budget_bytes;
      const bool fits = share <= 1.0 && share >= kKeyframeFill;
      if (!fits) keyframe_quantizer_ = coarser(quantizer, share / ((1.0 + kKeyframeFill) / 2.0));
      if (fits || i == kKeyframeTries || quantizer == keyframe_quantizer_) {
        debt_bytes_ = 0.0;
        return bytes;
      }
    }
  }

  Result<std::vector<std::byte>> code_planes(VideoFrame frame) {
    const vpx_enc_frame_flags_t flags = frame == VideoFrame::Keyframe ? VPX_EFLAG_FORCE_KF : 0;
    if (vpx_codec_encode(codec_.get(), planes_.get(), time_ticks_, static_cast<unsigned long>(frame_ticks_),
                         flags, VPX_DL_REALTIME) != VPX_CODEC_OK)
      return vpx_error("cannot encode VP8", codec_.get(), ErrorCode::Internal);
    time_ticks_ += frame_ticks_;
    std::vector<std::byte> bytes;
    vpx_codec_iter_t iterator = nullptr;
    while (const vpx_codec_cx_pkt_t* packet = vpx_codec_get_cx_data(codec_.get(), &iterator)) {
      if (packet->kind != VPX_CODEC_CX_FRAME_PKT) continue;
      const auto* begin = static_cast<const std::byte*>(packet->data.frame.buf);
      bytes.insert(bytes.end(), begin, begin + packet->data.frame.sz);
    }
    if (bytes.empty()) return make_error(ErrorCode::Internal, "the VP8 encoder dropped a picture");
    int quantizer = 0;
    if (vpx_codec_control(codec_.get(), VP8E_GET_LAST_QUANTIZER_64, &quantizer) == VPX_CODEC_OK)
      last_quantizer_ = static_cast<uint32_t>(std::clamp(quantizer, 0, static_cast<int>(kCoarsestQuantizer)));
    last_bytes_ = static_cast<double>(bytes.size());
    debt_bytes_ = std::max(debt_bytes_ + last_bytes_ - average_bytes(), 0.0);
    return bytes;
  }

  struct Quantizers {
    uint32_t finest, coarsest;
  };
  Status set_rate(Quantizers allowed) {
    const unsigned target = kilobits(config().bits_per_s);
    if (target == vpx_.rc_target_bitrate && allowed.finest == vpx_.rc_min_quantizer &&
        allowed.coarsest == vpx_.rc_max_quantizer)
      return {};
    vpx_.rc_target_bitrate = target;
    vpx_.rc_min_quantizer = allowed.finest;
    vpx_.rc_max_quantizer = allowed.coarsest;
    if (vpx_codec_enc_config_set(codec_.get(), &vpx_) != VPX_CODEC_OK)
      return vpx_error("cannot change the VP8 encoder", codec_.get(), ErrorCode::Internal);
    return {};
  }

  vpx_codec_enc_cfg_t vpx_{};
  CodecPtr codec_;
  std::unique_ptr<vpx_image_t, FreePlanes> planes_;
  const int64_t frame_ticks_;
  int64_t time_ticks_ = 0;
  uint32_t keyframe_quantizer_ = kFirstQuantizer, last_quantizer_ = kFirstQuantizer;
  double last_bytes_ = 0.0, debt_bytes_ = 0.0;
};

class Vp8Decoder : public VideoDecoder {
 public:
  explicit Vp8Decoder(CodecPtr codec) : VideoDecoder(PictureCodec::Vp8), codec_(std::move(codec)) {}

 private:
  Result<Image> decode_checked(std::span<const std::byte> frame, const VideoFrameInfo& info) override {
    const auto* data = reinterpret_cast<const uint8_t*>(frame.data());
    if (vpx_codec_decode(codec_.get(), data, static_cast<unsigned>(frame.size()), nullptr, 0) != VPX_CODEC_OK)
      return vpx_error("damaged VP8 frame", codec_.get(), ErrorCode::BadInput);
    int corrupted = 0;
    (void)vpx_codec_control(codec_.get(), VP8D_GET_FRAME_CORRUPTED, &corrupted);
    vpx_codec_iter_t iterator = nullptr;
    const vpx_image_t* planes = vpx_codec_get_frame(codec_.get(), &iterator);
    if (corrupted != 0 || planes == nullptr || planes->fmt != VPX_IMG_FMT_I420 || planes->d_w != info.width ||
        planes->d_h != info.height)
      return make_error(ErrorCode::BadInput, "a VP8 frame of {} bytes gives no picture of {} x {}",
                        frame.size(), info.width, info.height);
    return make_image(planes_of(*planes), info.width, info.height);
  }

  CodecPtr codec_;
};

}  // namespace

Result<std::unique_ptr<VideoEncoder>> make_vp8_encoder(const VideoConfig& config) {
  auto encoder = std::make_unique<Vp8Encoder>(config);
  RETURN_IF_ERROR(encoder->start());
  return std::unique_ptr<VideoEncoder>(std::move(encoder));
}

Result<std::unique_ptr<VideoDecoder>> make_vp8_decoder() {
  vpx_codec_dec_cfg_t config{};
  config.threads = 1;
  auto codec = std::make_unique<vpx_codec_ctx_t>();
  if (vpx_codec_dec_init(codec.get(), vpx_codec_vp8_dx(), &config, 0) != VPX_CODEC_OK)
    return vpx_error("cannot start the VP8 decoder", codec.get(), ErrorCode::Internal);
  return std::unique_ptr<VideoDecoder>(std::make_unique<Vp8Decoder>(CodecPtr(codec.release())));
}

Result<VideoFrameInfo> read_vp8_info(std::span<const std::byte> frame) {
  if (frame.size() < kTagBytes)
    return make_error(ErrorCode::BadInput, "a VP8 frame of {} bytes has no tag", frame.size());
  const auto byte = [&](size_t i) { return std::to_integer<uint32_t>(frame[i]); };
  VideoFrameInfo info;
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
  RETURN_IF_ERROR(check_picture_size(info.width, info.height));
  return info;
}

}  // namespace strandcast

// H.264 by libavcodec, which is loaded when the first stream needs it: it brings a hundred libraries, and
// linked it would make every program start 0.1 s later.
#include <dlfcn.h>
extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/opt.h>
}

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <utility>
#include <vector>

#include "common/pictures/video_rows.h"
#include "common/pictures/yuv_planes.h"

namespace strandcast {
namespace {

constexpr double kH264TicksPerS = 1000.0;
constexpr int kNoKeyframes = 1 << 20;     // pictures between two
constexpr int kFinestH264Quantizer = 12;  // of 0..51
constexpr int64_t kUnlimitedBits = 1'000'000'000;
constexpr int64_t kMaxDecodedPixels = int64_t{kMaxPictureWidth + 16} * (kMaxPictureHeight + 16);

/// What is called of libavcodec, and of libavutil, which comes with it.
// clang-format off
#define LIBAV_FUNCTIONS(X) \
  X(av_dict_free) X(av_dict_set) X(av_frame_alloc) X(av_frame_free) X(av_frame_get_buffer) \
  X(av_frame_make_writable) X(av_frame_unref) X(av_log_set_level) X(av_new_packet) X(av_packet_alloc) \
  X(av_packet_free) X(av_packet_unref) X(av_strerror) X(avcodec_alloc_context3) X(avcodec_find_decoder) \
  X(avcodec_find_encoder_by_name) X(avcodec_free_context) X(avcodec_open2) X(avcodec_receive_frame) \
  X(avcodec_receive_packet) X(avcodec_send_frame) X(avcodec_send_packet)
// clang-format on

struct LibAv {
#define LIBAV_MEMBER(name) decltype(&::name) name = nullptr;
  LIBAV_FUNCTIONS(LIBAV_MEMBER)
#undef LIBAV_MEMBER
};

/// The library of the version that the headers are from.
std::string libav_file() {
  return fmt::format("libavcodec.so.{}", LIBAVCODEC_VERSION_MAJOR);
}

/// Loaded for good.
Result<LibAv> load_libav() {
  const std::string file = libav_file();
  void* const library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return make_error(ErrorCode::Unsupported, "no H.264: {}", dlerror());
  LibAv loaded;
#define LIBAV_FIND(name)                                                    \
  loaded.name = reinterpret_cast<decltype(&::name)>(dlsym(library, #name)); \
  if (loaded.name == nullptr) return make_error(ErrorCode::Unsupported, "{} has no {}", file, #name);
  LIBAV_FUNCTIONS(LIBAV_FIND)
#undef LIBAV_FIND
  loaded.av_log_set_level(AV_LOG_QUIET);  // it would print what hostile input makes it think
  return loaded;
}

const Result<LibAv>& libav_or_error() {
  static const Result<LibAv> loaded = load_libav();
  return loaded;
}

/// The loaded library, for objects that exist only where it is loaded.
const LibAv& libav() {
  return *libav_or_error();
}

/// Folders that the dynamic linker looks into, but for those of its cache's configuration.
std::vector<std::filesystem::path> library_folders() {
  void* const program = dlopen(nullptr, RTLD_NOW);
  Dl_serinfo size{};
  if (program == nullptr || dlinfo(program, RTLD_DI_SERINFOSIZE, &size) != 0) return {};
  std::vector<std::max_align_t> memory(size.dls_size / sizeof(std::max_align_t) + 1);
  auto* const info = reinterpret_cast<Dl_serinfo*>(memory.data());
  std::vector<std::filesystem::path> folders;
  if (dlinfo(program, RTLD_DI_SERINFOSIZE, info) != 0 || dlinfo(program, RTLD_DI_SERINFO, info) != 0)
    return {};
  for (unsigned i = 0; i < info->dls_cnt; ++i) folders.emplace_back(info->dls_serpath[i].dls_name);
  return folders;
}

struct FreeContext {
  void operator()(AVCodecContext* context) const { libav().avcodec_free_context(&context); }
};
using ContextPtr = std::unique_ptr<AVCodecContext, FreeContext>;
struct FreeFrame {
  void operator()(AVFrame* frame) const { libav().av_frame_free(&frame); }
};
using FramePtr = std::unique_ptr<AVFrame, FreeFrame>;
struct FreePacket {
  void operator()(AVPacket* packet) const { libav().av_packet_free(&packet); }
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
  libav().av_strerror(code, text.data(), text.size());
  return make_error(kind, "{}: {}", what, text.data());
}

YuvPlanes planes_of(const AVFrame& frame) {
  return {{frame.data[0], frame.linesize[0]},
          {frame.data[1], frame.linesize[1]},
          {frame.data[2], frame.linesize[2]}};
}

void set_rate(AVCodecContext& context, double bits_per_s, VideoRate rate) {
  const int64_t bits = rate == VideoRate::Finest ? kUnlimitedBits : std::llround(bits_per_s);
  context.rc_max_rate = bits;
  context.rc_buffer_size = static_cast<int>(static_cast<double>(bits) * kVideoBufferS);
}

Result<ContextPtr> open_encoder(const VideoConfig& config, VideoRate rate) {
  const AVCodec* codec = libav().avcodec_find_encoder_by_name(kEncoder);
  if (codec == nullptr) return make_error(ErrorCode::Unsupported, "libavcodec has no {}", kEncoder);
  ContextPtr context(libav().avcodec_alloc_context3(codec));
  if (!context) return make_error(ErrorCode::Internal, "no memory for an H.264 encoder");
  context->width = static_cast<int>(config.width);
  context->height = static_cast<int>(config.height);
  context->pix_fmt = AV_PIX_FMT_YUV420P;
  context->framerate = {static_cast<int>(std::lround(config.rate_hz * kH264TicksPerS)),
                        static_cast<int>(kH264TicksPerS)};
  context->time_base = av_inv_q(context->framerate);
  context->gop_size = kNoKeyframes;
  context->max_b_frames = 0;
  context->refs = 1;
  context->thread_count = 1;
  context->flags |= AV_CODEC_FLAG_LOW_DELAY;
  context->color_range = AVCOL_RANGE_MPEG;
  context->colorspace = AVCOL_SPC_SMPTE170M;
  context->qmin = kFinestH264Quantizer;
  set_rate(*context, config.bits_per_s, rate);
  AVDictionary* options = nullptr;
  for (const auto& [key, value] : kEncoderOptions) libav().av_dict_set(&options, key, value, 0);
  const int opened = libav().avcodec_open2(context.get(), codec, &options);
  libav().av_dict_free(&options);
  if (opened < 0) return av_error(kEncoder, opened, ErrorCode::Unsupported);
  return context;
}

/// What libavcodec takes and gives.
struct Buffers {
  FramePtr frame;
  PacketPtr packet;
};

Result<Buffers> make_buffers() {
  RETURN_IF_ERROR(libav_or_error());
  Buffers buffers{FramePtr(libav().av_frame_alloc()), PacketPtr(libav().av_packet_alloc())};
  if (!buffers.frame || !buffers.packet)
    return make_error(ErrorCode::Internal, "no memory for an H.264 picture");
  return buffers;
}

class H264Encoder : public VideoEncoder {
 public:
  H264Encoder(const VideoConfig& config, Buffers buffers)
      : VideoEncoder(config), frame_(std::move(buffers.frame)), packet_(std::move(buffers.packet)) {}

  Status start() {
    ASSIGN_OR_RETURN(context_, open_encoder(config(), VideoRate::Target));
    frame_->format = AV_PIX_FMT_YUV420P;
    frame_->width = static_cast<int>(config().width);
    frame_->height = static_cast<int>(config().height);
    frame_->pts = 0;
    if (const int made = libav().av_frame_get_buffer(frame_.get(), 0); made < 0)
      return av_error("no memory for an H.264 picture", made, ErrorCode::Internal);
    return {};
  }

 private:
  Result<std::vector<std::byte>> code(const Image& image, VideoFrame frame, VideoRate rate) override {
    if (rate == VideoRate::Finest) {
      // x264 would fill its empty buffer at the higher rate only after this picture.
      ASSIGN_OR_RETURN(context_, open_encoder(config(), rate));
    } else {
      set_rate(*context_, config().bits_per_s, rate);  // x264 looks whether it is another one
    }
    if (const int ready = libav().av_frame_make_writable(frame_.get()); ready < 0)
      return av_error("no memory for an H.264 picture", ready, ErrorCode::Internal);
    fill_planes(image, planes_of(*frame_));
    frame_->pict_type = frame == VideoFrame::Keyframe ? AV_PICTURE_TYPE_I : AV_PICTURE_TYPE_NONE;
    ++frame_->pts;
    int done = libav().avcodec_send_frame(context_.get(), frame_.get());
    if (done >= 0) done = libav().avcodec_receive_packet(context_.get(), packet_.get());
    if (done < 0) return av_error("cannot encode H.264", done, ErrorCode::Internal);
    const auto* begin = reinterpret_cast<const std::byte*>(packet_->data);
    std::vector<std::byte> bytes(begin, begin + packet_->size);
    libav().av_packet_unref(packet_.get());
    return bytes;
  }

  ContextPtr context_;
  FramePtr frame_;
  PacketPtr packet_;
};

Result<ContextPtr> open_decoder() {
  const AVCodec* codec = libav().avcodec_find_decoder(AV_CODEC_ID_H264);
  ContextPtr context(codec != nullptr ? libav().avcodec_alloc_context3(codec) : nullptr);
  if (!context) return make_error(ErrorCode::Unsupported, "libavcodec has no H.264 decoder");
  context->thread_count = 1;
  context->flags |= AV_CODEC_FLAG_LOW_DELAY;
  context->max_pixels = kMaxDecodedPixels;
  context->error_concealment = FF_EC_FAVOR_INTER;  // anything but 0, or parts that are missing go unnoticed
  context->err_recognition = AV_EF_EXPLODE | AV_EF_BITSTREAM | AV_EF_BUFFER;
  if (const int opened = libav().avcodec_open2(context.get(), codec, nullptr); opened < 0)
    return av_error("cannot start the H.264 decoder", opened, ErrorCode::Internal);
  return context;
}

class H264Decoder : public VideoDecoder {
 public:
  H264Decoder(ContextPtr context, Buffers buffers)
      : VideoDecoder(PictureCodec::H264),
        context_(std::move(context)),
        frame_(std::move(buffers.frame)),
        packet_(std::move(buffers.packet)) {}

 private:
  Result<Image> decode_checked(std::span<const std::byte> frame, const VideoFrameInfo& info) override {
    // Nothing of before: a keyframe mends everything, and no more pictures are kept than one stream needs.
    if (info.is_keyframe) {
      ASSIGN_OR_RETURN(context_, open_decoder());
    }
    libav().av_packet_unref(packet_.get());
    if (const int made = libav().av_new_packet(packet_.get(), static_cast<int>(frame.size())); made < 0)
      return av_error("no memory for an H.264 frame", made, ErrorCode::Internal);
    std::memcpy(packet_->data, frame.data(), frame.size());
    int done = libav().avcodec_send_packet(context_.get(), packet_.get());
    if (done >= 0) done = libav().avcodec_receive_frame(context_.get(), frame_.get());
    if (done < 0) return av_error("damaged H.264 frame", done, ErrorCode::BadInput);
    const bool is_whole = frame_->decode_error_flags == 0 && (frame_->flags & AV_FRAME_FLAG_CORRUPT) == 0;
    const bool is_plain = frame_->format == AV_PIX_FMT_YUV420P || frame_->format == AV_PIX_FMT_YUVJ420P;
    if (!is_whole || !is_plain || frame_->width != static_cast<int>(info.width) ||
        frame_->height != static_cast<int>(info.height))
      return make_error(ErrorCode::BadInput, "an H.264 frame of {} bytes gives no picture of {} x {}",
                        frame.size(), info.width, info.height);
    Image image = make_image(planes_of(*frame_), info.width, info.height);
    libav().av_frame_unref(frame_.get());
    return image;
  }

  ContextPtr context_;
  FramePtr frame_;
  PacketPtr packet_;
};

}  // namespace

bool is_h264_installed() {
  const std::vector<std::filesystem::path> folders = library_folders();
  return std::any_of(folders.begin(), folders.end(),
                     [](const auto& folder) { return std::filesystem::exists(folder / libav_file()); }) ||
         libav_or_error().ok();
}

Result<std::unique_ptr<VideoEncoder>> make_h264_encoder(const VideoConfig& config) {
  ASSIGN_OR_RETURN(Buffers buffers, make_buffers());
  auto encoder = std::make_unique<H264Encoder>(config, std::move(buffers));
  RETURN_IF_ERROR(encoder->start());
  return std::unique_ptr<VideoEncoder>(std::move(encoder));
}

Result<std::unique_ptr<VideoDecoder>> make_h264_decoder() {
  ASSIGN_OR_RETURN(Buffers buffers, make_buffers());
  ASSIGN_OR_RETURN(ContextPtr context, open_decoder());
  return std::unique_ptr<VideoDecoder>(std::make_unique<H264Decoder>(std::move(context), std::move(buffers)));
}

}  // namespace strandcast

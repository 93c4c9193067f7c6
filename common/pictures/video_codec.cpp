#include "common/pictures/video_codec.h"

#include <algorithm>
#include <array>
#include <utility>

#include "common/pictures/h264_header.h"
#include "common/pictures/image_check.h"
#include "common/pictures/video_rows.h"

namespace strandcast {
namespace {

constexpr double kMinBitsPerS = 8e3;
constexpr double kMaxBitsPerS = 1e9;
constexpr double kMinRateHz = 0.01;
constexpr double kMaxRateHz = 1e3;

struct Row {
  PictureCodec codec;
  uint32_t side_step;  // of which both sides are multiples
  Result<std::unique_ptr<VideoEncoder>> (*make_encoder)(const VideoConfig& config);
  Result<std::unique_ptr<VideoDecoder>> (*make_decoder)();
  Result<VideoFrameInfo> (*read_info)(std::span<const std::byte> frame);
};
constexpr std::array kRows = {
    Row{PictureCodec::Vp8, 1, make_vp8_encoder, make_vp8_decoder, read_vp8_info},
    Row{PictureCodec::H264, 2, make_h264_encoder, make_h264_decoder, read_h264_info},
};

Result<Row> find_row(PictureCodec codec) {
  for (const Row& row : kRows)
    if (row.codec == codec) return row;
  return make_error(ErrorCode::BadInput, "{} is no video", to_string(codec));
}

}  // namespace

Result<std::unique_ptr<VideoEncoder>> make_video_encoder(PictureCodec codec, const VideoConfig& config) {
  ASSIGN_OR_RETURN(const Row row, find_row(codec));
  const bool fits = config.width % row.side_step == 0 && config.height % row.side_step == 0;
  if (!fits || !check_picture_size(config.width, config.height))
    return make_error(ErrorCode::BadInput, "{} of {} x {}, allowed are multiples of {} within {} to {} x {}",
                      to_string(codec), config.width, config.height, row.side_step, kMinPictureSide,
                      kMaxPictureWidth, kMaxPictureHeight);
  if (!(config.rate_hz > 0.0) || !(config.bits_per_s > 0.0))
    return make_error(ErrorCode::BadInput, "{} at {} Hz and {} bit/s", to_string(codec), config.rate_hz,
                      config.bits_per_s);
  VideoConfig usable = config;
  usable.rate_hz = std::clamp(config.rate_hz, kMinRateHz, kMaxRateHz);
  usable.bits_per_s = std::clamp(config.bits_per_s, kMinBitsPerS, kMaxBitsPerS);
  return row.make_encoder(usable);
}

Result<std::unique_ptr<VideoDecoder>> make_video_decoder(PictureCodec codec) {
  ASSIGN_OR_RETURN(const Row row, find_row(codec));
  return row.make_decoder();
}

Result<VideoFrameInfo> read_video_info(PictureCodec codec, std::span<const std::byte> frame) {
  ASSIGN_OR_RETURN(const Row row, find_row(codec));
  return row.read_info(frame);
}

void VideoEncoder::set_bits_per_s(double bits_per_s) {
  config_.bits_per_s = std::clamp(bits_per_s, kMinBitsPerS, kMaxBitsPerS);
}

Result<std::vector<std::byte>> VideoEncoder::encode(const Image& image, VideoFrame frame, VideoRate rate) {
  RETURN_IF_ERROR(check_image(image));
  if (image.width != config_.width || image.height != config_.height)
    return make_error(ErrorCode::BadInput, "a picture of {} x {} for a video of {} x {}", image.width,
                      image.height, config_.width, config_.height);
  return code(image, frame, rate);
}

Result<Image> VideoDecoder::decode(std::span<const std::byte> frame) {
  const uint32_t width = std::exchange(width_, 0);  // until this one is decoded
  ASSIGN_OR_RETURN(VideoFrameInfo info, read_video_info(codec_, frame));
  if (!info.is_keyframe) {
    info.width = width;
    info.height = height_;
  }
  if (info.width == 0)
    return make_error(ErrorCode::BadInput, "a {} delta frame without the frame before it", to_string(codec_));
  ASSIGN_OR_RETURN(Image image, decode_checked(frame, info));
  width_ = info.width;
  height_ = info.height;
  return image;
}

}  // namespace strandcast

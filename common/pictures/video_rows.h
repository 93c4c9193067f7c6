// The codecs behind video_codec.h, one row of its table each. Private to common/pictures. What both do alike
// is done there: encoders are made with sizes and rates in range, decoders see what the reader let through.
#pragma once

#include "common/pictures/video_codec.h"

namespace strandcast {

Result<std::unique_ptr<VideoEncoder>> make_vp8_encoder(const VideoConfig& config);
Result<std::unique_ptr<VideoDecoder>> make_vp8_decoder();
/// RFC 6386, section 9.1.
Result<VideoFrameInfo> read_vp8_info(std::span<const std::byte> frame);

Result<std::unique_ptr<VideoEncoder>> make_h264_encoder(const VideoConfig& config);
Result<std::unique_ptr<VideoDecoder>> make_h264_decoder();
/// Whether the build has H.264 and its library is there, which is loaded only where it has to be searched for.
bool is_h264_installed();

/// What the rate control of either may borrow from the time around.
inline constexpr double kVideoBufferS = 0.6;

}  // namespace strandcast

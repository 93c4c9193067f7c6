// Makers and header readers of the video codecs: VP8 and H.264, one row each of the table in video_codec.cpp.
// Private to common/pictures. Callers check sizes and rates first; decoders get only frames that the header
// reader accepted.
#pragma once

#include "common/pictures/video_codec.h"

namespace strandcast {

Result<std::unique_ptr<VideoEncoder>> make_vp8_encoder(const VideoConfig& config);
Result<std::unique_ptr<VideoDecoder>> make_vp8_decoder();
/// Reads the header of a VP8 frame (RFC 6386, section 9.1).
Result<VideoFrameInfo> read_vp8_info(std::span<const std::byte> frame);

Result<std::unique_ptr<VideoEncoder>> make_h264_encoder(const VideoConfig& config);
Result<std::unique_ptr<VideoDecoder>> make_h264_decoder();
/// Whether the build has H.264 and its library is there, which is loaded only where it has to be searched
/// for.
bool is_h264_installed();

/// Size of the rate control's buffer in seconds, by which both codecs may exceed the bit rate for a while.
inline constexpr double kVideoBufferS = 0.6;

}  // namespace strandcast

// What an H.264 frame says before it is decoded: the kinds of its units and the size of its picture. Only the
// plain form that encoders for live video make is let through to the decoder. Pure functions, any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "common/pictures/video_codec.h"

namespace strandcast {

/// Pictures that a decoder has to keep; with the limits of the size this bounds its memory.
inline constexpr uint32_t kMaxVideoReferences = 4;
inline constexpr size_t kMaxH264Units = 64;

/// Untrusted input: units behind start codes (ITU-T H.264, annex B). BadInput for what is no frame of that
/// form, Unsupported for interlaced pictures, colours not at half the size or more than 8 bits, LimitExceeded
/// for sizes and counts beyond the limits.
Result<VideoFrameInfo> read_h264_info(std::span<const std::byte> frame);

}  // namespace strandcast

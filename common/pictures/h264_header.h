// Reads what an H.264 frame states before decoding: the kinds of its units and the size of its picture. Only
// the plain form that live encoders produce may reach the decoder. Pure functions, any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "common/pictures/video_codec.h"

namespace strandcast {

/// Largest number of reference pictures that a decoder keeps; with the size limits this bounds its memory.
inline constexpr uint32_t kMaxVideoReferences = 4;
inline constexpr size_t kMaxH264Units = 64;

/// Reads an untrusted frame: units after start codes (ITU-T H.264, annex B). BadInput for malformed frames.
/// Unsupported for interlaced pictures, chroma other than 4:2:0 and more than 8 bits. LimitExceeded beyond
/// the limits of sizes and counts.
Result<VideoFrameInfo> read_h264_info(std::span<const std::byte> frame);

}  // namespace strandcast

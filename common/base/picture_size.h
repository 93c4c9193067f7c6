// The size of a rendered picture in pixels and its limits. Requests, drawing, encoding and decoding all use
// these.
#pragma once

#include <cstdint>

namespace strandcast {

inline constexpr uint32_t kMinPictureSide = 16;
inline constexpr uint32_t kMaxPictureWidth = 3840;
inline constexpr uint32_t kMaxPictureHeight = 2160;

struct RenderSize {
  uint32_t width = 640;
  uint32_t height = 360;
};

}  // namespace strandcast

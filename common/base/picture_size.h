// The size of a rendered picture in pixels: what may be asked for, drawn, sent and decoded. Here and nowhere
// else.
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

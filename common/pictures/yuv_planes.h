// Converts pictures to and from the planes of video codecs: BT.601, studio range, chroma at half the size in
// both directions. Private to common/pictures; pure functions, any thread.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/pictures/image_codec.h"

namespace strandcast {

struct YuvPlane {
  uint8_t* data = nullptr;
  ptrdiff_t stride_bytes = 0;
};
/// Each colour plane has (width + 1) / 2 x (height + 1) / 2 samples.
struct YuvPlanes {
  YuvPlane luma, blue, red;
};

/// Converts with rounding to nearest; chroma is the mean of four pixels. libyuv rounds chroma down, which
/// tints every picture green by a level.
void fill_planes(const Image& image, const YuvPlanes& planes);

/// Converts the first width x height pixels of the planes.
Image make_image(const YuvPlanes& planes, uint32_t width, uint32_t height);

}  // namespace strandcast

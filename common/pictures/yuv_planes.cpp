#include "common/pictures/yuv_planes.h"

#include <libyuv/convert_argb.h>

#include <algorithm>
#include <array>

namespace strandcast {
namespace {

constexpr size_t kRgbaBytes = 4;

/// Parts of red, green and blue, times 65536: ITU-R BT.601 with 219 levels of luma from 16 on, and 224 of
/// colour around 128.
struct Weights {
  int32_t red, green, blue;
};
constexpr int kShift = 16;
constexpr Weights kLuma = {16829, 33039, 6416};
constexpr Weights kBlue = {-9714, -19070, 28784};
constexpr Weights kRed = {28784, -24103, -4681};
constexpr int32_t kLumaBase = 16, kColourBase = 128;
static_assert(kBlue.red + kBlue.green + kBlue.blue == 0 && kRed.red + kRed.green + kRed.blue == 0,
              "grey has no colour");

/// A base and weighted levels, of sums of 1 << `log_count` pixels.
uint8_t weigh(const Weights& weights, std::array<int32_t, 3> rgb, int32_t base, int log_count) {
  const int shift = kShift + log_count;
  const int32_t sum = weights.red * rgb[0] + weights.green * rgb[1] + weights.blue * rgb[2];
  return static_cast<uint8_t>((sum + (base << shift) + (1 << (shift - 1))) >> shift);
}

void fill_luma(const Image& image, const YuvPlane& plane) {
  for (size_t y = 0; y < image.height; ++y) {
    const uint8_t* pixel = image.rgba.data() + y * image.width * kRgbaBytes;
    uint8_t* sample = plane.data + static_cast<ptrdiff_t>(y) * plane.stride_bytes;
    for (size_t x = 0; x < image.width; ++x, pixel += kRgbaBytes)
      sample[x] = weigh(kLuma, {pixel[0], pixel[1], pixel[2]}, kLumaBase, 0);
  }
}

void fill_colours(const Image& image, const YuvPlanes& planes) {
  for (size_t y = 0; y < image.height; y += 2) {
    const uint8_t* upper = image.rgba.data() + y * image.width * kRgbaBytes;
    const uint8_t* lower = y + 1 < image.height ? upper + size_t{image.width} * kRgbaBytes : upper;
    uint8_t* blue = planes.blue.data + static_cast<ptrdiff_t>(y / 2) * planes.blue.stride_bytes;
    uint8_t* red = planes.red.data + static_cast<ptrdiff_t>(y / 2) * planes.red.stride_bytes;
    for (size_t x = 0; x < image.width; x += 2) {
      const size_t left = x * kRgbaBytes;
      const size_t right = x + 1 < image.width ? left + kRgbaBytes : left;
      std::array<int32_t, 3> sum{};
      for (size_t c = 0; c < sum.size(); ++c)
        sum[c] = upper[left + c] + upper[right + c] + lower[left + c] + lower[right + c];
      blue[x / 2] = weigh(kBlue, sum, kColourBase, 2);
      red[x / 2] = weigh(kRed, sum, kColourBase, 2);
    }
  }
}

}  // namespace

void fill_planes(const Image& image, const YuvPlanes& planes) {
  fill_luma(image, planes.luma);
  fill_colours(image, planes);
}

Image make_image(const YuvPlanes& planes, uint32_t width, uint32_t height) {
  Image image{width, height, std::vector<uint8_t>(size_t{width} * height * kRgbaBytes)};
  // In memory R, G, B, A; libyuv names formats by their words.
  libyuv::I420ToABGR(planes.luma.data, static_cast<int>(planes.luma.stride_bytes), planes.blue.data,
                     static_cast<int>(planes.blue.stride_bytes), planes.red.data,
                     static_cast<int>(planes.red.stride_bytes), image.rgba.data(),
                     static_cast<int>(width * kRgbaBytes), static_cast<int>(width), static_cast<int>(height));
  return image;
}

}  // namespace strandcast

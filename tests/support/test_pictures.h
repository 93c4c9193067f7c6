// Pictures for tests: thin bright lines that wave over a plain background, as hair does, and measures of how
// alike two pictures are.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include "common/pictures/image_codec.h"

namespace strandcast::test {

/// Lines cover the left `share` of the picture and move with `phase`; the rest stays as it is.
inline Image waving_lines(uint32_t width, uint32_t height, double phase, double share = 1.0) {
  Image image{width, height, std::vector<uint8_t>(size_t{width} * height * 4, 255)};
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x) {
      const double bend = 6.0 * std::sin(0.05 * y + phase);
      const double line = std::pow(0.5 + 0.5 * std::sin(0.7 * (x + bend)), 3.0);
      const double level = x < share * width ? 40.0 + 180.0 * line : 60.0;
      uint8_t* pixel = image.rgba.data() + (size_t{y} * width + x) * 4;
      pixel[0] = static_cast<uint8_t>(level);
      pixel[1] = static_cast<uint8_t>(0.7 * level);
      pixel[2] = static_cast<uint8_t>(0.5 * level + 20.0);
    }
  return image;
}

/// The same in grey: no colour, so that only the brightness is coded.
inline Image in_grey(Image image) {
  for (size_t i = 0; i < image.rgba.size(); i += 4) image.rgba[i + 1] = image.rgba[i + 2] = image.rgba[i];
  return image;
}

/// Root mean square of the differences of red, green and blue.
inline double rms_difference(const Image& a, const Image& b) {
  if (a.width != b.width || a.height != b.height) return std::numeric_limits<double>::infinity();
  double sum = 0.0;
  for (size_t i = 0; i < a.rgba.size(); ++i)
    if (i % 4 != 3) sum += std::pow(static_cast<double>(a.rgba[i]) - b.rgba[i], 2.0);
  return std::sqrt(sum / (0.75 * static_cast<double>(a.rgba.size())));
}

/// dB
inline double psnr(const Image& a, const Image& b) {
  return 20.0 * std::log10(255.0 / std::max(rms_difference(a, b), 1e-6));
}

}  // namespace strandcast::test

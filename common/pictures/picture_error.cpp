#include "common/pictures/picture_error.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/check.h"

namespace strandcast {
namespace {

constexpr double kNoDifferenceDb = 99.0;

double linear_of(uint8_t srgb) {
  static const auto kTable = [] {
    std::array<double, 256> table{};
    for (size_t i = 0; i < table.size(); ++i) {
      const double value = static_cast<double>(i) / 255.0;
      table[i] = value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
    }
    return table;
  }();
  return kTable[srgb];
}

uint8_t srgb_of(double linear) {
  const double value = linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
  return static_cast<uint8_t>(std::lround(255.0 * std::clamp(value, 0.0, 1.0)));
}

struct Lab {
  double l, a, b;
};

/// CIE 1976, white point D65.
Lab lab_of(double red, double green, double blue) {
  const auto f = [](double t) { return t > 0.008856 ? std::cbrt(t) : 7.787 * t + 16.0 / 116.0; };
  const double x = f((0.4124 * red + 0.3576 * green + 0.1805 * blue) / 0.95047);
  const double y = f(0.2126 * red + 0.7152 * green + 0.0722 * blue);
  const double z = f((0.0193 * red + 0.1192 * green + 0.9505 * blue) / 1.08883);
  return {116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)};
}

double luma(const uint8_t* pixel) {
  return 0.299 * pixel[0] + 0.587 * pixel[1] + 0.114 * pixel[2];
}

/// Blocks that hold a pixel of the mask.
double mean_ssim(const Image& seen, const Image& truth, const PictureMask& mask) {
  constexpr uint32_t kBlock = 8;
  constexpr double kC1 = 0.01 * 255.0 * 0.01 * 255.0;
  constexpr double kC2 = 0.03 * 255.0 * 0.03 * 255.0;
  double sum = 0.0;
  size_t blocks = 0;
  for (uint32_t y = 0; y < seen.height; y += kBlock)
    for (uint32_t x = 0; x < seen.width; x += kBlock) {
      double n = 0.0, a = 0.0, b = 0.0, aa = 0.0, bb = 0.0, ab = 0.0;
      bool is_masked = false;
      for (uint32_t v = y; v < std::min(y + kBlock, seen.height); ++v)
        for (uint32_t u = x; u < std::min(x + kBlock, seen.width); ++u) {
          const size_t i = size_t{v} * seen.width + u;
          is_masked |= mask[i] != 0;
          const double p = luma(&seen.rgba[4 * i]);
          const double q = luma(&truth.rgba[4 * i]);
          n += 1.0;
          a += p;
          b += q;
          aa += p * p;
          bb += q * q;
          ab += p * q;
        }
      if (!is_masked) continue;
      a /= n;
      b /= n;
      const double va = aa / n - a * a;
      const double vb = bb / n - b * b;
      const double cov = ab / n - a * b;
      sum += (2.0 * a * b + kC1) * (2.0 * cov + kC2) / ((a * a + b * b + kC1) * (va + vb + kC2));
      ++blocks;
    }
  return sum / static_cast<double>(std::max<size_t>(blocks, 1));
}

/// The light of 3 x 3 pixels round (x, y), as L*a*b*.
Lab soft_lab(const Image& image, uint32_t x, uint32_t y) {
  std::array<double, 3> sum{};
  double n = 0.0;
  for (uint32_t v = y > 0 ? y - 1 : 0; v <= std::min(y + 1, image.height - 1); ++v)
    for (uint32_t u = x > 0 ? x - 1 : 0; u <= std::min(x + 1, image.width - 1); ++u) {
      for (size_t c = 0; c < 3; ++c) sum[c] += linear_of(image.rgba[4 * (size_t{v} * image.width + u) + c]);
      n += 1.0;
    }
  return lab_of(sum[0] / n, sum[1] / n, sum[2] / n);
}

}  // namespace

PictureMask mask_of(const Image& picture, const Image& without_subject) {
  CHECK(picture.rgba.size() == without_subject.rgba.size());
  PictureMask mask(picture.rgba.size() / 4);
  for (size_t i = 0; i < mask.size(); ++i)
    for (size_t c = 0; c < 3; ++c)
      if (std::abs(picture.rgba[4 * i + c] - without_subject.rgba[4 * i + c]) > 1) mask[i] = 1;
  return mask;
}

Result<PictureError> picture_error(const Image& seen, const Image& truth, const PictureMask& mask) {
  if (seen.width != truth.width || seen.height != truth.height || mask.size() * 4 != seen.rgba.size() ||
      seen.rgba.size() != truth.rgba.size())
    return make_error(ErrorCode::BadInput, "pictures of {} x {} and {} x {} pixels cannot be compared",
                      seen.width, seen.height, truth.width, truth.height);
  double squares = 0.0;
  double distance = 0.0;
  size_t counted = 0;
  for (uint32_t y = 0; y < seen.height; ++y)
    for (uint32_t x = 0; x < seen.width; ++x) {
      const size_t i = size_t{y} * seen.width + x;
      if (mask[i] == 0) continue;
      ++counted;
      for (size_t c = 0; c < 3; ++c) {
        const double difference = static_cast<double>(seen.rgba[4 * i + c]) - truth.rgba[4 * i + c];
        squares += difference * difference;
      }
      const Lab a = soft_lab(seen, x, y);
      const Lab b = soft_lab(truth, x, y);
      distance += std::hypot(a.l - b.l, a.a - b.a, a.b - b.b);
    }
  if (counted == 0) return make_error(ErrorCode::BadInput, "no pixel of the mask is set");
  PictureError error;
  const auto n = static_cast<double>(counted);
  const double mean_square = squares / (3.0 * n);
  error.psnr_db = mean_square > 0.0
                      ? std::min(kNoDifferenceDb, 10.0 * std::log10(255.0 * 255.0 / mean_square))
                      : kNoDifferenceDb;
  error.ssim = mean_ssim(seen, truth, mask);
  error.delta_e = distance / n;
  error.masked_share = n / static_cast<double>(mask.size());
  return error;
}

Image shrunk(const Image& image, uint32_t factor) {
  CHECK(factor > 0 && image.width % factor == 0 && image.height % factor == 0);
  Image small{image.width / factor, image.height / factor, {}};
  small.rgba.resize(4 * size_t{small.width} * small.height);
  const double share = 1.0 / (static_cast<double>(factor) * factor);
  for (uint32_t y = 0; y < small.height; ++y)
    for (uint32_t x = 0; x < small.width; ++x) {
      std::array<double, 3> sum{};
      for (uint32_t v = 0; v < factor; ++v)
        for (uint32_t u = 0; u < factor; ++u)
          for (size_t c = 0; c < 3; ++c)
            sum[c] += linear_of(image.rgba[4 * (size_t{y * factor + v} * image.width + x * factor + u) + c]);
      uint8_t* const pixel = &small.rgba[4 * (size_t{y} * small.width + x)];
      for (size_t c = 0; c < 3; ++c) pixel[c] = srgb_of(sum[c] * share);
      pixel[3] = 255;
    }
  return small;
}

}  // namespace strandcast

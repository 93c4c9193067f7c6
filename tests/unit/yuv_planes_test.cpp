#include "common/pictures/yuv_planes.h"

#include <algorithm>
#include <array>

#include "tests/support/test_pictures.h"

namespace strandcast::yuv_planes_test {
namespace {

/// There and back, without a codec between.
Image there_and_back(const Image& image) {
  const size_t columns = (image.width + 1) / 2, rows = (image.height + 1) / 2;
  std::vector<uint8_t> luma(size_t{image.width} * image.height), blue(columns * rows), red(columns * rows);
  const YuvPlanes planes{{luma.data(), static_cast<ptrdiff_t>(image.width)},
                         {blue.data(), static_cast<ptrdiff_t>(columns)},
                         {red.data(), static_cast<ptrdiff_t>(columns)}};
  fill_planes(image, planes);
  return make_image(planes, image.width, image.height);
}

TEST(YuvPlanes, ColoursAreNotTintedOnTheMean) {
  // A level of luma is 1.16 levels of grey, one of colour up to 2: with rounding the errors have no sign.
  // Rounding colours down instead would shift red and blue by 0.8 to 1 and green by 0.6 the other way.
  constexpr int kStep = 15;
  constexpr double kLeastTint = 0.6;
  std::array<double, 3> sum{};
  int count = 0;
  for (int r = 0; r <= 255; r += kStep)
    for (int g = 0; g <= 255; g += kStep)
      for (int b = 0; b <= 255; b += kStep, ++count) {
        Image image{2, 2, {}};
        for (int i = 0; i < 4; ++i)
          for (const int level : {r, g, b, 255}) image.rgba.push_back(static_cast<uint8_t>(level));
        const Image back = there_and_back(image);
        for (size_t c = 0; c < 3; ++c) {
          EXPECT_NEAR(back.rgba[c], image.rgba[c], 3) << r << " " << g << " " << b;
          sum[c] += back.rgba[c] - image.rgba[c];
        }
      }
  for (const double error : sum) EXPECT_LT(std::abs(error / count), kLeastTint / 2.0);
}

TEST(YuvPlanes, GreyStaysGreyAndOddEdgesAreKept) {
  for (const int level : {0, 1, 77, 128, 254, 255}) {
    const Image image{17, 19, std::vector<uint8_t>(17 * 19 * 4, static_cast<uint8_t>(level))};
    const Image back = there_and_back(image);
    for (size_t i = 0; i < back.rgba.size(); i += 4) {
      EXPECT_NEAR(back.rgba[i], level, 1);
      EXPECT_EQ(back.rgba[i], back.rgba[i + 1]);
      EXPECT_EQ(back.rgba[i], back.rgba[i + 2]);
    }
  }
}

}  // namespace
}  // namespace strandcast::yuv_planes_test

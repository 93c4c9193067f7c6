#include "common/pictures/picture_error.h"

#include <gmock/gmock.h>

#include <cmath>

namespace strandcast::picture_error_test {
namespace {

Image plain(uint32_t width, uint32_t height, uint8_t value) {
  Image image{width, height, {}};
  image.rgba.assign(size_t{width} * height * 4, value);
  for (size_t i = 3; i < image.rgba.size(); i += 4) image.rgba[i] = 255;
  return image;
}
PictureMask all_of(const Image& image) {
  return PictureMask(image.rgba.size() / 4, 1);
}

TEST(PictureError, EqualPicturesHaveNone) {
  const Image image = plain(20, 12, 77);
  const auto error = picture_error(image, image, all_of(image));
  ASSERT_TRUE(error);
  EXPECT_EQ(error->psnr_db, 99.0);
  EXPECT_DOUBLE_EQ(error->ssim, 1.0);
  EXPECT_DOUBLE_EQ(error->delta_e, 0.0);
  EXPECT_DOUBLE_EQ(error->masked_share, 1.0);
}

TEST(PictureError, FollowsItsDefinitions) {
  const Image dark = plain(16, 16, 100);
  const Image light = plain(16, 16, 110);
  const auto error = picture_error(light, dark, all_of(dark));
  ASSERT_TRUE(error);
  EXPECT_NEAR(error->psnr_db, 20.0 * std::log10(255.0 / 10.0), 1e-9);
  // Blocks without structure differ by luma alone: (2 a b + C1) / (a^2 + b^2 + C1).
  EXPECT_NEAR(error->ssim, (2.0 * 110 * 100 + 6.5025) / (110.0 * 110 + 100.0 * 100 + 6.5025), 1e-9);
  // L* of sRGB grey 100 is 42.37 and of 110 is 46.44 (CIE 1976).
  EXPECT_NEAR(error->delta_e, 46.44 - 42.37, 0.05);
}

TEST(PictureError, CountsOnlyTheMask) {
  const Image truth = plain(16, 8, 50);
  Image seen = truth;
  seen.rgba[0] = 250;
  PictureMask mask(16 * 8, 1);
  mask[0] = 0;
  const auto error = picture_error(seen, truth, mask);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->psnr_db, 99.0);
  EXPECT_FALSE(picture_error(seen, truth, PictureMask(16 * 8, 0)));
  EXPECT_FALSE(picture_error(seen, plain(8, 8, 0), mask));
  // One step of a colour is noise, two are the subject.
  Image with = truth;
  with.rgba[4] = 51;
  with.rgba[8] = 52;
  const PictureMask found = mask_of(with, truth);
  EXPECT_EQ(found[1], 0);
  EXPECT_EQ(found[2], 1);
}

TEST(PictureError, ShrinkingKeepsTheLight) {
  Image board = plain(4, 4, 0);
  for (size_t i = 0; i < 16; i += 2)
    for (size_t c = 0; c < 3; ++c) board.rgba[4 * i + c] = 255;
  const Image small = shrunk(board, 4);
  ASSERT_EQ(small.rgba.size(), 4u);
  // Half of the light is sRGB 188.
  EXPECT_EQ(small.rgba[0], 188);
  EXPECT_EQ(small.rgba[3], 255);
}

}  // namespace
}  // namespace strandcast::picture_error_test

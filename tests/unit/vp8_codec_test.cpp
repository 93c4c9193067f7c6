#include "common/codec/vp8_codec.h"

#include "common/codec/picture.h"
#include "tests/support/test_pictures.h"

namespace strandcast {
namespace {

using test::in_grey;
using test::psnr;
using test::waving_lines;
using Frame = Vp8Encoder::Frame;
using Rate = Vp8Encoder::Rate;

constexpr uint32_t kWidth = 160, kHeight = 90;

Vp8Encoder make_encoder(double bits_per_s = 2e6) {
  auto encoder = Vp8Encoder::make({kWidth, kHeight, 30.0, bits_per_s});
  EXPECT_TRUE(encoder) << encoder.error().to_string();
  return std::move(*encoder);
}

Vp8Decoder make_decoder() {
  auto decoder = Vp8Decoder::make();
  EXPECT_TRUE(decoder);
  return std::move(*decoder);
}

TEST(Vp8, TheFinestFrameIsWithinItsQuantiser) {
  // Quantiser 4 divides coefficients by 8, which are twice those of a transform that keeps squares (RFC 6386,
  // sections 14.1 and 14.3): an error of at most 4 each, were the dead zone a whole step; grey, as colours
  // are halved besides.
  constexpr double kLeastPsnr = 20.0 * 1.80618;  // 20 log10(255 / 4)
  Vp8Encoder encoder = make_encoder();
  Vp8Decoder decoder = make_decoder();
  for (int i = 0; i < 5; ++i) {
    const Image image = in_grey(waving_lines(kWidth, kHeight, 0.2 * i));
    const auto bytes = encoder.encode(image, Frame::Delta, Rate::Finest);
    ASSERT_TRUE(bytes) << bytes.error().to_string();
    EXPECT_EQ(read_vp8_info(*bytes)->is_keyframe, i == 0) << "no keyframe unless asked for";
    const auto back = decoder.decode(*bytes);
    ASSERT_TRUE(back) << back.error().to_string();
    EXPECT_GE(psnr(image, *back), kLeastPsnr) << i;
  }
}

TEST(Vp8, TheRateIsKeptAndMayChangeWithoutAKeyframe) {
  Vp8Encoder encoder = make_encoder(1e6);
  const auto mean_bytes = [&](int first, int count) {
    size_t bytes = 0;
    for (int i = first; i < first + count; ++i) {
      const auto frame = encoder.encode(waving_lines(kWidth, kHeight, 0.3 * i), Frame::Delta, Rate::Target);
      EXPECT_TRUE(frame);
      EXPECT_EQ(read_vp8_info(*frame)->is_keyframe, i == 0);
      bytes += frame->size();
    }
    return static_cast<double>(bytes) / count;
  };
  (void)mean_bytes(0, 30);
  EXPECT_NEAR(mean_bytes(30, 60), 1e6 / 30.0 / 8.0, 0.25 * 1e6 / 30.0 / 8.0);
  encoder.set_bits_per_s(4e5);
  (void)mean_bytes(90, 30);
  EXPECT_NEAR(mean_bytes(120, 60), 4e5 / 30.0 / 8.0, 0.25 * 4e5 / 30.0 / 8.0);
}

TEST(Vp8, AKeyframeComesWhenAskedForAndStandsAlone) {
  Vp8Encoder encoder = make_encoder();
  for (int i = 0; i < 10; ++i)
    ASSERT_TRUE(encoder.encode(waving_lines(kWidth, kHeight, 0.1 * i), Frame::Delta, Rate::Target));
  const Image image = waving_lines(kWidth, kHeight, 1.0);
  const auto bytes = encoder.encode(image, Frame::Keyframe, Rate::Target);
  ASSERT_TRUE(bytes);
  const auto info = read_vp8_info(*bytes);
  ASSERT_TRUE(info);
  EXPECT_TRUE(info->is_keyframe);
  EXPECT_EQ(info->width, kWidth);
  EXPECT_EQ(info->height, kHeight);
  Vp8Decoder decoder = make_decoder();
  const auto back = decoder.decode(*bytes);
  ASSERT_TRUE(back) << back.error().to_string();
  EXPECT_GT(psnr(image, *back), 20.0);
}

TEST(Vp8, BlackAndWhiteStayBlackAndWhite) {
  // Studio range on both sides: neither lifted blacks nor dimmed whites.
  for (const uint8_t level : {uint8_t{0}, uint8_t{128}, uint8_t{255}}) {
    const Image image{kWidth, kHeight, std::vector<uint8_t>(size_t{kWidth} * kHeight * 4, level)};
    Vp8Encoder encoder = make_encoder();
    Vp8Decoder decoder = make_decoder();
    const auto back = decoder.decode(*encoder.encode(image, Frame::Keyframe, Rate::Finest));
    ASSERT_TRUE(back);
    for (size_t i = 0; i < 4 * 50; i += 4) EXPECT_NEAR(back->rgba[i], level, 4) << i;
  }
}

TEST(Vp8, WrongSizesAndRatesAreRefused) {
  EXPECT_EQ(Vp8Encoder::make({8, 100, 30.0, 1e6}).error().code, ErrorCode::BadInput);
  EXPECT_EQ(Vp8Encoder::make({100, kMaxPictureHeight + 1, 30.0, 1e6}).error().code, ErrorCode::BadInput);
  EXPECT_EQ(Vp8Encoder::make({100, 100, 0.0, 1e6}).error().code, ErrorCode::BadInput);
  EXPECT_EQ(Vp8Encoder::make({100, 100, 30.0, std::nan("")}).error().code, ErrorCode::BadInput);
  Vp8Encoder encoder = make_encoder();
  EXPECT_FALSE(encoder.encode(waving_lines(kWidth + 1, kHeight, 0.0), Frame::Delta, Rate::Target));
}

TEST(Vp8, HostileSizesNeverReachTheDecoder) {
  Vp8Encoder encoder = make_encoder();
  const auto good = *encoder.encode(waving_lines(kWidth, kHeight, 0.0), Frame::Keyframe, Rate::Target);
  const auto with_size = [&](uint16_t width, uint16_t height) {
    auto bad = good;
    bad[6] = static_cast<std::byte>(width & 0xff);
    bad[7] = static_cast<std::byte>(width >> 8);
    bad[8] = static_cast<std::byte>(height & 0xff);
    bad[9] = static_cast<std::byte>(height >> 8);
    return bad;
  };
  for (const auto& [width, height] :
       {std::pair{0, 0}, {16383, 16383}, {3841, 90}, {160, 2161}, {15, 90}, {0x4000 | 160, 90}})
    EXPECT_EQ(
        read_vp8_info(with_size(static_cast<uint16_t>(width), static_cast<uint16_t>(height))).error().code,
        ErrorCode::LimitExceeded)
        << width << " x " << height;
  auto bad = good;
  bad[3] = std::byte{0};
  EXPECT_FALSE(read_vp8_info(bad));
  for (size_t size = 0; size < 10; ++size) EXPECT_FALSE(read_vp8_info(std::span(good).first(size))) << size;
  Vp8Decoder decoder = make_decoder();
  const auto delta = *encoder.encode(waving_lines(kWidth, kHeight, 0.1), Frame::Delta, Rate::Target);
  EXPECT_FALSE(decoder.decode(delta)) << "without the keyframe";
}

TEST(Vp8, DamageNeverCrashesAndAKeyframeMendsEverything) {
  Vp8Encoder encoder = make_encoder();
  const auto key = *encoder.encode(waving_lines(kWidth, kHeight, 0.0), Frame::Keyframe, Rate::Target);
  const auto delta = *encoder.encode(waving_lines(kWidth, kHeight, 0.4), Frame::Delta, Rate::Target);
  Vp8Decoder decoder = make_decoder();
  uint32_t seed = 7;
  const auto random = [&] { return seed = seed * 1664525u + 1013904223u, seed >> 8; };
  for (int round = 0; round < 1500; ++round) {
    auto bad = round % 2 == 0 ? key : delta;
    for (uint32_t i = 0; i <= random() % 4; ++i)
      bad[random() % bad.size()] = static_cast<std::byte>(random());
    if (random() % 4 == 0) bad.resize(random() % bad.size());
    if (const auto image = decoder.decode(bad)) {
      ASSERT_EQ(image->rgba.size(), size_t{image->width} * image->height * 4);
    }
    if (round % 50 == 0) {
      ASSERT_TRUE(decoder.decode(key)) << round;
    }
  }
}

}  // namespace
}  // namespace strandcast

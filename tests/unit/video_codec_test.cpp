// Both video codecs, by the same tests: an encoder that is asked for pictures of hair, and a decoder that is
// given what it made, whole, late or damaged.
#include "common/pictures/video_codec.h"

#include <algorithm>
#include <cmath>

#include "common/pictures/picture_decoder.h"
#include "tests/support/test_pictures.h"

namespace strandcast::video_codec_test {
namespace {

using test::in_grey;
using test::psnr;
using test::waving_lines;

constexpr uint32_t kWidth = 160, kHeight = 90;

struct VideoCase {
  PictureCodec codec;
  double finest_error;   // levels that the finest quantiser may be wrong by
  bool is_finest_alone;  // finest frames are keyframes
  bool has_odd_sizes;
};
void PrintTo(const VideoCase& row, std::ostream* out) {
  *out << to_string(row.codec);
}
/// VP8: quantiser 4 divides coefficients by 8, which are twice those of a transform that keeps squares
/// (RFC 6386, sections 14.1 and 14.3): an error of at most 4 each, were the dead zone a whole step.
/// H.264: quantiser 12 has steps of 2.5 (ITU-T H.264, table 8-15 gives 0.625 for 0, doubled every 6), at
/// quality 12 a few more: at most 8, were every coefficient wrong by a whole step of 8.
constexpr VideoCase kCases[] = {{PictureCodec::Vp8, 4.0, false, true},
                                {PictureCodec::H264, 8.0, true, false}};

class Video : public testing::TestWithParam<VideoCase> {
 protected:
  void SetUp() override {
    if ((decodable_picture_codecs() & codec_bit(codec_)) == 0)
      GTEST_SKIP() << "built without libavcodec (CMake: -DSTRANDCAST_H264=ON)";
    if ((encodable_picture_codecs() & codec_bit(codec_)) == 0)
      GTEST_SKIP() << "libavcodec has no H.264 encoder that starts here";
  }
  std::unique_ptr<VideoEncoder> make_encoder(double bits_per_s = 2e6) const {
    auto encoder = make_video_encoder(codec_, {kWidth, kHeight, 30.0, bits_per_s});
    EXPECT_TRUE(encoder) << encoder.error().to_string();
    return std::move(*encoder);
  }
  std::unique_ptr<VideoDecoder> make_decoder() const { return std::move(*make_video_decoder(codec_)); }
  VideoFrameInfo info_of(std::span<const std::byte> frame) const {
    const auto info = read_video_info(codec_, frame);
    EXPECT_TRUE(info) << info.error().to_string();
    return *info;
  }

  const PictureCodec codec_ = GetParam().codec;
};

std::string name_of(const testing::TestParamInfo<VideoCase>& row) {
  return to_string(row.param.codec);
}
INSTANTIATE_TEST_SUITE_P(Codecs, Video, testing::ValuesIn(kCases), name_of);

/// One of the chain, moved by `phase`.
std::vector<std::byte> delta(VideoEncoder& encoder, double phase) {
  auto bytes = encoder.encode(waving_lines(kWidth, kHeight, phase), VideoFrame::Delta, VideoRate::Target);
  EXPECT_TRUE(bytes) << bytes.error().to_string();
  return std::move(*bytes);
}

TEST_P(Video, EveryPictureComesOutAtOnceAndOnlyTheFirstIsAKeyframe) {
  const auto encoder = make_encoder();
  const auto decoder = make_decoder();
  for (int i = 0; i < 40; ++i) {
    const auto bytes = delta(*encoder, 0.1 * i);
    EXPECT_EQ(info_of(bytes).is_keyframe, i == 0);
    const auto back = decoder->decode(bytes);
    ASSERT_TRUE(back) << i << ": " << back.error().to_string();
    EXPECT_GT(psnr(waving_lines(kWidth, kHeight, 0.1 * i), *back),
              psnr(waving_lines(kWidth, kHeight, 0.1 * (i - 1)), *back))
        << "this one, not the last";
  }
}

/// No picture helps with the next, so every rate is too low for it.
Image noise(uint32_t seed) {
  Image image{kWidth, kHeight, {}};
  for (uint32_t i = 0; i < kWidth * kHeight; ++i) {
    seed = seed * 1664525u + 1013904223u;
    const auto level = static_cast<uint8_t>(96 + (seed >> 26));
    image.rgba.insert(image.rgba.end(), {level, level, level, 255});
  }
  return image;
}

TEST_P(Video, TheRateIsKeptAndMayChangeWithoutAKeyframe) {
  const auto encoder = make_encoder(1e6);
  const auto mean_bytes = [&](uint32_t first, uint32_t count) {
    size_t bytes = 0;
    for (uint32_t i = first; i < first + count; ++i) {
      const auto frame = encoder->encode(noise(i), VideoFrame::Delta, VideoRate::Target);
      EXPECT_TRUE(frame);
      EXPECT_EQ(info_of(*frame).is_keyframe, i == 0);
      bytes += frame->size();
    }
    return static_cast<double>(bytes) / count;
  };
  (void)mean_bytes(0, 30);
  EXPECT_NEAR(mean_bytes(30, 60), 1e6 / 30.0 / 8.0, 0.25 * 1e6 / 30.0 / 8.0);
  encoder->set_bits_per_s(4e5);
  (void)mean_bytes(90, 30);
  EXPECT_NEAR(mean_bytes(120, 60), 4e5 / 30.0 / 8.0, 0.25 * 4e5 / 30.0 / 8.0);
}

/// A disc of waving lines before a plain ground, as a head of hair is.
Image disc_of_lines(double phase) {
  constexpr double kRadius = 0.2 * kHeight;
  Image image = waving_lines(kWidth, kHeight, phase);
  for (uint32_t y = 0; y < kHeight; ++y)
    for (uint32_t x = 0; x < kWidth; ++x)
      if (std::hypot(x - 0.5 * kWidth, y - 0.5 * kHeight) > kRadius)
        for (size_t channel = 0; channel < 3; ++channel)
          image.rgba[(size_t{y} * kWidth + x) * 4 + channel] = 90;
  return image;
}

TEST_P(Video, FirstPicturesLookLikeLaterOnes) {
  constexpr int kFirst = 5, kAll = 40;
  constexpr double kRateHz = 15.0, kBitsPerPixel = 0.25, kStepRad = 0.02;
  const double bits_per_s = kBitsPerPixel * kWidth * kHeight * kRateHz;
  const auto encoder = *make_video_encoder(codec_, {kWidth, kHeight, kRateHz, bits_per_s});
  const auto decoder = make_decoder();
  double worst_first = 1e9, mean_late = 0.0;
  size_t bytes = 0;
  for (int i = 0; i < kAll; ++i) {
    const Image image = disc_of_lines(kStepRad * i);
    const auto frame = encoder->encode(image, VideoFrame::Delta, VideoRate::Target);
    ASSERT_TRUE(frame);
    const double quality_db = psnr(image, *decoder->decode(*frame));
    if (i < kFirst) worst_first = std::min(worst_first, quality_db);
    if (i >= kAll - kFirst) mean_late += quality_db / kFirst;
    bytes += frame->size();
  }
  EXPECT_GT(worst_first, mean_late - 4.0);
  EXPECT_GT(worst_first, 28.0);
  // A keyframe takes up to five pictures' worth.
  EXPECT_LT(static_cast<double>(bytes), 1.1 * (kAll + 4) * bits_per_s / kRateHz / 8.0);
}

TEST_P(Video, AKeyframeComesWhenAskedForAndStandsAlone) {
  const auto encoder = make_encoder();
  for (int i = 0; i < 10; ++i) (void)delta(*encoder, 0.1 * i);
  const Image image = waving_lines(kWidth, kHeight, 1.0);
  const auto bytes = encoder->encode(image, VideoFrame::Keyframe, VideoRate::Target);
  ASSERT_TRUE(bytes);
  const VideoFrameInfo info = info_of(*bytes);
  EXPECT_TRUE(info.is_keyframe);
  EXPECT_EQ(info.width, kWidth);
  EXPECT_EQ(info.height, kHeight);
  const auto back = make_decoder()->decode(*bytes);
  ASSERT_TRUE(back) << back.error().to_string();
  EXPECT_GT(psnr(image, *back), 20.0);
}

TEST_P(Video, TheFinestFrameIsWithinItsQuantiserWhateverTheRate) {
  // Grey, as colours are halved besides.
  const double least_psnr = 20.0 * std::log10(255.0 / GetParam().finest_error);
  const auto encoder = make_encoder(2e5);
  const auto decoder = make_decoder();
  ASSERT_TRUE(decoder->decode(delta(*encoder, 0.0)));
  for (int i = 1; i < 5; ++i) {
    const Image image = in_grey(waving_lines(kWidth, kHeight, 0.2 * i));
    const auto bytes = encoder->encode(image, VideoFrame::Delta, VideoRate::Finest);
    ASSERT_TRUE(bytes) << bytes.error().to_string();
    EXPECT_EQ(info_of(*bytes).is_keyframe, GetParam().is_finest_alone);
    const auto back = decoder->decode(*bytes);
    ASSERT_TRUE(back) << back.error().to_string();
    EXPECT_GE(psnr(image, *back), least_psnr) << i;
  }
}

TEST_P(Video, BlackAndWhiteStayBlackAndWhite) {
  // Studio range on both sides: neither lifted blacks nor dimmed whites.
  for (const uint8_t level : {uint8_t{0}, uint8_t{128}, uint8_t{255}}) {
    const Image image{kWidth, kHeight, std::vector<uint8_t>(size_t{kWidth} * kHeight * 4, level)};
    const auto encoder = make_encoder();
    const auto back =
        make_decoder()->decode(*encoder->encode(image, VideoFrame::Keyframe, VideoRate::Finest));
    ASSERT_TRUE(back);
    for (size_t i = 0; i < 4 * 50; i += 4) EXPECT_NEAR(back->rgba[i], level, 4) << i;
  }
}

TEST_P(Video, WrongSizesAndRatesAreRefused) {
  const auto refusal = [&](const VideoConfig& config) {
    const auto encoder = make_video_encoder(codec_, config);
    EXPECT_FALSE(encoder.ok());
    return encoder ? ErrorCode::Internal : encoder.error().code;
  };
  EXPECT_EQ(refusal({8, 100, 30.0, 1e6}), ErrorCode::BadInput);
  EXPECT_EQ(refusal({100, kMaxPictureHeight + 2, 30.0, 1e6}), ErrorCode::BadInput);
  EXPECT_EQ(refusal({100, 100, 0.0, 1e6}), ErrorCode::BadInput);
  EXPECT_EQ(refusal({100, 100, 30.0, std::nan("")}), ErrorCode::BadInput);
  const auto encoder = make_encoder();
  const auto other =
      encoder->encode(waving_lines(kWidth + 2, kHeight, 0.0), VideoFrame::Delta, VideoRate::Target);
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, ErrorCode::BadInput);
}

TEST_P(Video, OddSizesAreCodedWholeOrRefused) {
  const auto encoder = make_video_encoder(codec_, {kWidth + 1, kHeight + 1, 30.0, 2e6});
  ASSERT_EQ(encoder.ok(), GetParam().has_odd_sizes);
  if (!encoder) {
    EXPECT_EQ(encoder.error().code, ErrorCode::BadInput);
    return;
  }
  const Image image = waving_lines(kWidth + 1, kHeight + 1, 0.0);
  const auto back = make_decoder()->decode(*(*encoder)->encode(image, VideoFrame::Delta, VideoRate::Finest));
  ASSERT_TRUE(back) << back.error().to_string();
  EXPECT_EQ(back->width, kWidth + 1);
  EXPECT_EQ(back->height, kHeight + 1);
  EXPECT_GT(psnr(image, *back), 20.0);
}

TEST_P(Video, ADeltaNeedsItsKeyframe) {
  const auto encoder = make_encoder();
  const auto first = delta(*encoder, 0.0), second = delta(*encoder, 0.1);
  const auto decoder = make_decoder();
  EXPECT_EQ(decoder->decode(second).error().code, ErrorCode::BadInput);
  EXPECT_TRUE(decoder->decode(first));
  EXPECT_TRUE(decoder->decode(second));
  EXPECT_FALSE(decoder->decode(std::span(second).first(2))) << "no frame at all";
  EXPECT_FALSE(decoder->decode(second)) << "only a keyframe helps";
  EXPECT_TRUE(decoder->decode(first));
}

TEST_P(Video, TheHeaderSaysWhetherItStandsAlone) {
  const auto encoder = make_encoder();
  const auto first = delta(*encoder, 0.0), second = delta(*encoder, 0.3);
  const auto header = [&](uint32_t sequence, uint32_t base) {
    FrameHeader made;
    made.opcode = opcode_of(codec_);
    made.stream_id = kPictureStreamBit;
    made.sequence = sequence;
    made.base_sequence = base;
    return made;
  };
  PictureDecoder decoder;
  const auto refusal = [&](const FrameHeader& after_1, std::span<const std::byte> frame) {
    EXPECT_TRUE(decoder.decode(header(1, 0), first));
    const Status decoded = decoder.decode(after_1, frame);
    EXPECT_FALSE(decoded.ok());
    return decoded ? ErrorCode::Internal : decoded.error().code;
  };
  EXPECT_EQ(refusal(header(2, 0), second), ErrorCode::BadInput) << "a delta as a keyframe";
  EXPECT_EQ(refusal(header(2, 1), first), ErrorCode::BadInput) << "a keyframe as a delta";
  EXPECT_EQ(refusal(header(3, 2), second), ErrorCode::Unavailable) << "2 never came";
  ASSERT_TRUE(decoder.decode(header(1, 0), first));
  EXPECT_TRUE(decoder.decode(header(2, 1), second));
}

TEST_P(Video, DamageNeverCrashesAndAKeyframeMendsEverything) {
  const auto encoder = make_encoder();
  const auto first = delta(*encoder, 0.0), second = delta(*encoder, 0.4);
  const auto decoder = make_decoder();
  const auto good = decoder->decode(first);
  ASSERT_TRUE(good);
  uint32_t seed = 7;
  const auto random = [&] { return seed = seed * 1664525u + 1013904223u, seed >> 8; };
  int refused = 0;
  for (int round = 0; round < 600; ++round) {
    auto bad = round % 2 == 0 ? first : second;
    for (uint32_t i = 0; i <= random() % 4; ++i)
      bad[random() % bad.size()] = static_cast<std::byte>(random());
    if (random() % 4 == 0) bad.resize(random() % bad.size());
    if (const auto image = decoder->decode(bad)) {
      ASSERT_EQ(image->rgba.size(), size_t{image->width} * image->height * 4);
    } else {
      ++refused;
    }
    if (round % 50 != 0) continue;
    const auto mended = decoder->decode(first);
    ASSERT_TRUE(mended) << round;
    EXPECT_TRUE(*mended == *good) << round;
  }
  EXPECT_GT(refused, 100);
}

/// What only H.264 promises: the last part of a VP8 frame says nowhere how long it is.
class H264Stream : public Video {};
INSTANTIATE_TEST_SUITE_P(Codecs, H264Stream, testing::Values(kCases[1]), name_of);

TEST_P(H264Stream, APartOfAFrameIsNoPicture) {
  const auto encoder = make_encoder();
  const auto first = delta(*encoder, 0.0), second = delta(*encoder, 0.3);
  const auto decoder = make_decoder();
  for (const size_t quarters : {1, 2, 3}) {
    ASSERT_TRUE(decoder->decode(first));
    EXPECT_FALSE(decoder->decode(std::span(second).first(second.size() * quarters / 4))) << quarters;
    EXPECT_FALSE(decoder->decode(second)) << "only a keyframe helps";
    EXPECT_FALSE(decoder->decode(std::span(first).first(first.size() * quarters / 4))) << quarters;
  }
}

TEST(VideoCodecs, WhatIsNoVideoHasNone) {
  for (const PictureCodec codec : {PictureCodec::Jpeg, PictureCodec::JpegTiles}) {
    EXPECT_EQ(make_video_encoder(codec, {kWidth, kHeight}).error().code, ErrorCode::BadInput);
    EXPECT_EQ(make_video_decoder(codec).error().code, ErrorCode::BadInput);
    EXPECT_EQ(read_video_info(codec, {}).error().code, ErrorCode::BadInput);
  }
}

TEST(Vp8, HostileSizesNeverReachTheDecoder) {
  const auto encoder = make_video_encoder(PictureCodec::Vp8, {kWidth, kHeight});
  ASSERT_TRUE(encoder);
  const auto good = delta(**encoder, 0.0);
  const auto refusal = [](std::span<const std::byte> frame) {
    const auto info = read_video_info(PictureCodec::Vp8, frame);
    EXPECT_FALSE(info.ok());
    return info ? ErrorCode::Internal : info.error().code;
  };
  for (const auto& [width, height] :
       {std::pair{0, 0}, {16383, 16383}, {3841, 90}, {160, 2161}, {15, 90}, {0x4000 | 160, 90}}) {
    auto bad = good;
    bad[6] = static_cast<std::byte>(width & 0xff);
    bad[7] = static_cast<std::byte>(width >> 8);
    bad[8] = static_cast<std::byte>(height & 0xff);
    bad[9] = static_cast<std::byte>(height >> 8);
    EXPECT_EQ(refusal(bad), ErrorCode::LimitExceeded) << width << " x " << height;
  }
  auto bad = good;
  bad[3] = std::byte{0};
  EXPECT_EQ(refusal(bad), ErrorCode::BadInput);
  for (size_t size = 0; size < 10; ++size)
    EXPECT_EQ(refusal(std::span(good).first(size)), ErrorCode::BadInput) << size;
}

}  // namespace
}  // namespace strandcast::video_codec_test

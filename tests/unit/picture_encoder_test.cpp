#include "server/encode/picture_encoder.h"

#include <array>

#include "common/pictures/picture_decoder.h"
#include "server/encode/picture_ladder.h"
#include "tests/support/test_pictures.h"

namespace strandcast::picture_encoder_test {
namespace {

using test::psnr;
using test::waving_lines;

constexpr uint32_t kWidth = 200, kHeight = 130;
/// Those that can be encoded here.
std::vector<PictureCodec> codecs() {
  std::vector<PictureCodec> all;
  for (const PictureCodec codec : kPictureCodecs)
    if ((encodable_picture_codecs() & codec_bit(codec)) != 0) all.push_back(codec);
  return all;
}

constexpr PictureStamp kStamp{kPictureStreamBit | 5, 0, 0};

std::unique_ptr<PictureEncoder> make(PictureCodec codec, uint32_t last_sequence = 0) {
  PictureView view;
  view.size = {kWidth, kHeight};
  view.codec = codec;
  auto made = make_picture_encoder(view, 30.0, last_sequence);
  EXPECT_TRUE(made) << made.error().to_string();
  return std::move(*made);
}

/// A viewer as a session and a client are together.
struct Watcher {
  PictureDecoder decoder;
  uint32_t shown = 0;
  size_t bytes = 0;

  bool take(const Picture& picture) {
    if (!picture.can_follow(shown)) return false;
    const EncodedFramePtr frame = picture.after(shown);
    bytes = frame->message.size();
    const auto header = unpack_frame_header(frame->message);
    EXPECT_TRUE(header);
    const Status decoded = decoder.decode(*header, std::span(frame->message).subspan(kFrameHeaderBytes));
    EXPECT_TRUE(decoded) << (decoded ? "" : decoded.error().to_string());
    shown = picture.sequence();
    return decoded.ok();
  }
};

TEST(PictureEncoders, NothingIsSentOfAnUnchangedPicture) {
  for (const PictureCodec codec : codecs()) {
    const auto encoder = make(codec);
    const Image image = waving_lines(kWidth, kHeight, 0.0);
    ASSERT_NE(*encoder->encode(image, 80, kStamp), nullptr);
    EXPECT_EQ(*encoder->encode(image, 80, kStamp), nullptr) << to_string(codec);
    EXPECT_EQ(*encoder->encode(image, 50, kStamp), nullptr) << to_string(codec);
    EXPECT_EQ(encoder->sequence(), 1u);
    ASSERT_NE(*encoder->encode(waving_lines(kWidth, kHeight, 0.5), 80, kStamp), nullptr);
    EXPECT_EQ(encoder->sequence(), 2u);
  }
}

TEST(TilesEncoder, OnlyTilesThatChangedAreSent) {
  const auto encoder = make(PictureCodec::JpegTiles);
  Watcher watcher;
  Image image = waving_lines(kWidth, kHeight, 0.0);
  ASSERT_TRUE(watcher.take(**encoder->encode(image, 80, kStamp)));
  const size_t whole_bytes = watcher.bytes;
  // One pixel, in the last tile of 4 x 3.
  image.rgba[(size_t{kHeight - 1} * kWidth + kWidth - 1) * 4] ^= 0x80;
  const auto picture = *encoder->encode(image, 80, kStamp);
  const auto frame = picture->after(1);
  EXPECT_EQ(frame->header.base_sequence, 1u);
  EXPECT_EQ(static_cast<int>(frame->message[kFrameHeaderBytes + 4]), 1) << "tiles in the message";
  EXPECT_EQ(static_cast<int>(frame->message[kFrameHeaderBytes + kTilesFixedBytes]), 11) << "its place";
  EXPECT_LT(frame->message.size(), whole_bytes / 4);
}

TEST(TilesEncoder, EveryTileThatChangedIsSent) {
  const auto encoder = make(PictureCodec::JpegTiles);
  Watcher watcher;
  Image image = test::in_grey(waving_lines(kWidth, kHeight, 0.0));
  ASSERT_TRUE(watcher.take(**encoder->encode(image, 80, kStamp)));
  const uint32_t columns = tiles_along(kWidth), all = columns * tiles_along(kHeight);
  const auto fill = [&](uint32_t tile, uint8_t level) {
    const uint32_t left = tile % columns * kTileSide, top = tile / columns * kTileSide;
    for (uint32_t y = top; y < std::min(top + kTileSide, kHeight); ++y)
      for (uint32_t x = left; x < std::min(left + kTileSide, kWidth); ++x)
        std::fill_n(image.rgba.begin() + static_cast<ptrdiff_t>((size_t{y} * kWidth + x) * 4), 3, level);
  };
  // Every set of two of the tiles, each with a level of its own.
  for (uint32_t first = 0; first < all; ++first)
    for (uint32_t second = first + 1; second < all; ++second) {
      fill(first, static_cast<uint8_t>(40 + 17 * second % 200));
      fill(second, static_cast<uint8_t>(45 + 23 * first % 200));
      const auto picture = *encoder->encode(image, 80, kStamp);
      ASSERT_NE(picture, nullptr);
      ASSERT_TRUE(watcher.take(*picture));
      for (const uint32_t tile : {first, second}) {
        const size_t corner = size_t{tile / columns * kTileSide} * kWidth + tile % columns * kTileSide;
        EXPECT_NEAR(watcher.decoder.image()->rgba[corner * 4], image.rgba[corner * 4], 4) << "tile " << tile;
      }
    }
}

TEST(TilesEncoder, EveryCanvasIsTheServersAfterAnyDrops) {
  const auto encoder = make(PictureCodec::JpegTiles);
  Watcher diligent;  // gets everything
  std::array<Watcher, 6> careless;
  uint32_t seed = 3;
  const auto random = [&] { return seed = seed * 1664525u + 1013904223u, seed >> 8; };
  Image image = waving_lines(kWidth, kHeight, 0.0);
  size_t partial = 0;
  for (int i = 0; i < 200; ++i) {
    for (uint32_t change = 0; change < random() % 4; ++change) {
      const size_t at = random() % (kWidth * kHeight - 40);
      std::fill_n(image.rgba.begin() + static_cast<ptrdiff_t>(at * 4), 40 * 4,
                  static_cast<uint8_t>(random()));
      for (size_t k = 3; k < image.rgba.size(); k += 4) image.rgba[k] = 255;
    }
    const int quality = std::array{95, 80, 50, 30}[random() % 4];
    const bool is_still = random() % 10 == 0 && i > 0;
    const auto picture = is_still ? *encoder->still(kStamp) : *encoder->encode(image, quality, kStamp);
    if (picture == nullptr) continue;
    ASSERT_TRUE(diligent.take(*picture));
    Watcher joiner;
    ASSERT_TRUE(joiner.take(*picture));
    EXPECT_TRUE(*joiner.decoder.image() == *diligent.decoder.image()) << i;
    for (size_t k = 0; k < careless.size(); ++k) {
      if (random() % (2 + 2 * k) != 0) continue;
      const bool had_one = careless[k].shown != 0;
      ASSERT_TRUE(careless[k].take(*picture));
      EXPECT_TRUE(*careless[k].decoder.image() == *diligent.decoder.image()) << i << ", watcher " << k;
      partial += had_one && careless[k].bytes < joiner.bytes ? 1 : 0;
    }
  }
  EXPECT_GT(partial, 100u) << "most of them were changes, not whole pictures";
}

TEST(TilesEncoder, AnotherEncoderOfTheClassStartsWhole) {
  const auto first = make(PictureCodec::JpegTiles);
  Watcher watcher;
  ASSERT_TRUE(watcher.take(**first->encode(waving_lines(kWidth, kHeight, 0.0), 80, kStamp)));
  const auto second = make(PictureCodec::JpegTiles, first->sequence());
  const auto picture = *second->encode(waving_lines(kWidth, kHeight, 0.0), 80, kStamp);
  EXPECT_EQ(picture->sequence(), 2u);
  EXPECT_EQ(picture->after(1)->header.base_sequence, 0u) << "its tiles are not those of the other one";
}

TEST(PictureEncoders, AStillIsFineAndComesOnce) {
  // Grey, as colours at half the size would hide the rest; 20 pictures, as the first may borrow bits.
  const Image image = test::in_grey(waving_lines(kWidth, kHeight, 20.0));
  for (const PictureCodec codec : codecs()) {
    const auto encoder = make(codec);
    Watcher watcher;
    for (int i = 1; i <= 20; ++i)
      ASSERT_TRUE(
          watcher.take(**encoder->encode(test::in_grey(waving_lines(kWidth, kHeight, 1.0 * i)), 30, kStamp)));
    const double before = psnr(image, *watcher.decoder.image());
    const auto still = *encoder->still(kStamp);
    ASSERT_NE(still, nullptr) << to_string(codec);
    ASSERT_TRUE(watcher.take(*still));
    EXPECT_GT(psnr(image, *watcher.decoder.image()), before + 3.0) << to_string(codec);
    EXPECT_EQ(*encoder->still(kStamp), nullptr) << to_string(codec);
  }
  // Of what is as fine at once no other comes, and it says so.
  const auto flags_at = [&](int quality) {
    return (*make(PictureCodec::Jpeg)->encode(image, quality, kStamp))->after(0)->header.flags;
  };
  EXPECT_EQ(flags_at(kStillQuality - 1), 0);
  EXPECT_EQ(flags_at(kStillQuality), kStillPicture);
}

TEST(PictureEncoders, WhoeverAsksGetsAWholePicture) {
  const Image image = waving_lines(kWidth, kHeight, 0.9);
  for (const PictureCodec codec : codecs()) {
    const auto encoder = make(codec);
    Watcher old;
    ASSERT_TRUE(old.take(**encoder->encode(waving_lines(kWidth, kHeight, 0.8), 80, kStamp)));
    ASSERT_TRUE(old.take(**encoder->encode(image, 80, kStamp)));
    const auto whole = *encoder->whole(kStamp);
    Watcher joiner;
    ASSERT_TRUE(joiner.take(*whole)) << to_string(codec);
    EXPECT_GT(psnr(image, *joiner.decoder.image()), 20.0);
    // Tiles and whole pictures: the others have it already. Video: all go on from the keyframe.
    EXPECT_EQ(whole->can_follow(old.shown), is_video(codec));
    if (is_video(codec)) {
      EXPECT_TRUE(old.take(*whole));
    }
    const auto next = *encoder->encode(waving_lines(kWidth, kHeight, 1.0), 80, kStamp);
    EXPECT_TRUE(old.take(*next));
    EXPECT_TRUE(joiner.take(*next));
    EXPECT_TRUE(*old.decoder.image() == *joiner.decoder.image()) << to_string(codec);
  }
}

TEST(VideoEncoder, ALostPictureNeedsAKeyframe) {
  const auto encoder = make(PictureCodec::Vp8);
  Watcher watcher;
  ASSERT_TRUE(watcher.take(**encoder->encode(waving_lines(kWidth, kHeight, 0.0), 80, kStamp)));
  (void)*encoder->encode(waving_lines(kWidth, kHeight, 0.1), 80, kStamp);
  const auto third = *encoder->encode(waving_lines(kWidth, kHeight, 0.2), 80, kStamp);
  EXPECT_FALSE(third->can_follow(watcher.shown));
  EXPECT_EQ(third->after(watcher.shown), nullptr);
  EXPECT_TRUE(watcher.take(**encoder->whole(kStamp)));
}

TEST(VideoEncoder, KeyframesAreASecondApart) {
  const auto encoder = make(PictureCodec::Vp8);
  PictureStamp stamp = kStamp;
  stamp.time_ns = 50 * kKeyframePauseNs;
  ASSERT_TRUE(encoder->encode(waving_lines(kWidth, kHeight, 0.0), 80, stamp));
  EXPECT_EQ(encoder->whole_due_ns(), 51 * kKeyframePauseNs);
}

TEST(PictureLadder, FallsInQualityThenRateThenSizeAndAlwaysInCost) {
  for (const PictureCodec codec : kPictureCodecs)
    for (const int usual : {100, 95, 80, 50, 33, 30, 1}) {
      const auto steps = make_picture_ladder(codec, usual);
      EXPECT_EQ(steps.front().quality, std::max(usual, 95));
      EXPECT_EQ(steps[find_step(steps, usual)].quality, usual);
      EXPECT_EQ(steps[find_step(steps, usual)].rate_divisor, 1u);
      EXPECT_EQ(steps.front().relative_cost, 1.0);
      EXPECT_EQ(steps.back().size_divisor, 2u);
      for (size_t i = 1; i < steps.size(); ++i) {
        EXPECT_LT(steps[i].relative_cost, steps[i - 1].relative_cost) << usual << ", step " << i;
        EXPECT_LE(steps[i].quality, steps[i - 1].quality);
      }
    }
  std::vector<int> qualities;
  for (const PictureStep& step : make_picture_ladder(PictureCodec::JpegTiles, 80))
    qualities.push_back(step.quality);
  EXPECT_EQ(qualities, (std::vector<int>{95, 80, 50, 30, 30, 30}));
}

}  // namespace
}  // namespace strandcast::picture_encoder_test

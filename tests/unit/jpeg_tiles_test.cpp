#include "common/pictures/jpeg_tiles.h"

#include <algorithm>
#include <array>

#include "common/pictures/picture.h"
#include "tests/support/test_pictures.h"

namespace strandcast::jpeg_tiles_test {
namespace {

using test::in_grey;
using test::rms_difference;
using test::waving_lines;

/// Luminance table of ITU-T T.81, annex K.1; the quality scales it as the Independent JPEG Group does.
constexpr std::array kLuminance = {16, 11, 10, 16, 24,  40,  51,  61,  12, 12, 14, 19, 26,  58,  60,  55,
                                   14, 13, 16, 24, 40,  57,  69,  56,  14, 17, 22, 29, 51,  87,  80,  62,
                                   18, 22, 37, 56, 68,  109, 103, 77,  24, 35, 55, 64, 81,  104, 113, 92,
                                   49, 64, 78, 87, 103, 121, 120, 101, 72, 92, 95, 98, 112, 100, 103, 99};

/// The transform keeps squares, so a block's error is at most that of its coefficients: half a step each.
double largest_rms(int quality) {
  const int scale = quality < 50 ? 5000 / quality : 200 - 2 * quality;
  double sum = 0.0;
  for (const int step : kLuminance) sum += std::pow(std::clamp((step * scale + 50) / 100, 1, 255), 2.0) / 4.0;
  return std::sqrt(sum / kLuminance.size());
}

std::vector<std::byte> code(const Image& image, int quality, TileChroma chroma,
                            const std::vector<uint16_t>& places) {
  auto encoder = TileEncoder::make();
  std::vector<CodedTile> tiles;
  for (const uint16_t place : places)
    tiles.push_back(*encoder->encode(image, place, static_cast<uint8_t>(quality), chroma));
  std::vector<PlacedTile> placed;
  for (size_t i = 0; i < places.size(); ++i) placed.push_back({places[i], &tiles[i]});
  return pack_tiles(image.width, image.height, placed);
}

std::vector<uint16_t> all_places(const Image& image) {
  std::vector<uint16_t> places(tiles_along(image.width) * tiles_along(image.height));
  for (size_t i = 0; i < places.size(); ++i) places[i] = static_cast<uint16_t>(i);
  return places;
}

Image decode_all(const std::vector<std::byte>& payload) {
  Image canvas;
  TileDecoder decoder;
  const Status decoded = decoder.decode(payload, TileDecoder::Scope::Whole, canvas);
  EXPECT_TRUE(decoded) << (decoded ? "" : decoded.error().to_string());
  return canvas;
}

TEST(JpegTiles, GreyComesBackWithinTheErrorOfItsQuantisation) {
  constexpr double kRounding = 1.5;  // of the transforms, the colours and the pixels, half a level each
  for (const auto& [width, height] :
       {std::pair{64u, 64u}, {640u, 360u}, {16u, 16u}, {130u, 65u}, {1000u, 17u}})
    for (const int quality : {30, 50, 80, 95})
      for (const TileChroma chroma : {TileChroma::Halved, TileChroma::Full}) {
        const Image image = in_grey(waving_lines(width, height, 0.3));
        const Image back = decode_all(code(image, quality, chroma, all_places(image)));
        EXPECT_LE(rms_difference(image, back), largest_rms(quality) + kRounding)
            << width << " x " << height << ", quality " << quality;
      }
}

TEST(JpegTiles, FullChromaKeepsColoursThatHalvedLoses) {
  Image image = waving_lines(128, 128, 0.0);
  for (size_t i = 0; i < image.rgba.size(); i += 4)  // single columns of red and green
    (i / 4 % 2 == 0 ? image.rgba[i] : image.rgba[i + 1]) = 230;
  const Image halved = decode_all(code(image, 95, TileChroma::Halved, all_places(image)));
  const Image full = decode_all(code(image, 95, TileChroma::Full, all_places(image)));
  EXPECT_LT(2.0 * rms_difference(image, full), rms_difference(image, halved));
}

TEST(JpegTiles, ATileIsTheSameWhateverElseIsSentWithIt) {
  const Image image = waving_lines(300, 200, 1.0);
  const Image together = decode_all(code(image, 50, TileChroma::Halved, all_places(image)));
  Image one_by_one = together;
  std::fill(one_by_one.rgba.begin(), one_by_one.rgba.end(), uint8_t{7});
  TileDecoder decoder;
  for (const uint16_t place : all_places(image))
    ASSERT_TRUE(decoder.decode(code(image, 50, TileChroma::Halved, {place}), TileDecoder::Scope::Changes,
                               one_by_one));
  EXPECT_TRUE(one_by_one == together);
}

TEST(JpegTiles, QualitiesAndMoreTilesThanOnePassTakesMix) {
  const Image image = waving_lines(1920, 1080, 0.5);
  const auto places = all_places(image);
  ASSERT_GT(places.size(), 256u);
  auto encoder = TileEncoder::make();
  std::vector<CodedTile> tiles;
  for (const uint16_t place : places)
    tiles.push_back(*encoder->encode(image, place, place % 3 == 0 ? 95 : 80,
                                     place % 2 == 0 ? TileChroma::Full : TileChroma::Halved));
  std::vector<PlacedTile> placed;
  for (size_t i = 0; i < tiles.size(); ++i) placed.push_back({places[i], &tiles[i]});
  const Image back = decode_all(pack_tiles(image.width, image.height, placed));
  EXPECT_GT(test::psnr(image, back), 30.0);
}

class HostileTiles : public testing::Test {
 protected:
  void SetUp() override {
    image_ = waving_lines(200, 100, 0.0);
    whole_ = code(image_, 50, TileChroma::Halved, all_places(image_));
    canvas_ = decode_all(whole_);
    before_ = canvas_;
  }
  /// Refused, and the picture stays as it was.
  void expect_refused(const std::vector<std::byte>& payload, const char* what,
                      TileDecoder::Scope scope = TileDecoder::Scope::Changes) {
    TileDecoder decoder;
    const Status decoded = decoder.decode(payload, scope, canvas_);
    ASSERT_FALSE(decoded) << what;
    EXPECT_THAT(decoded.error().message, testing::HasSubstr(what));
    EXPECT_TRUE(canvas_ == before_) << what;
  }
  static void set_u16(std::vector<std::byte>& bytes, size_t at, uint16_t value) {
    bytes[at] = static_cast<std::byte>(value & 0xff);
    bytes[at + 1] = static_cast<std::byte>(value >> 8);
  }
  Image image_, canvas_, before_;
  std::vector<std::byte> whole_;
};

TEST_F(HostileTiles, SizesAndCountsAreCheckedFirst) {
  for (const auto& [width, height] :
       {std::pair{15, 100}, {200, 15}, {3841, 100}, {200, 2161}, {65535, 65535}}) {
    auto bad = whole_;
    set_u16(bad, 0, static_cast<uint16_t>(width));
    set_u16(bad, 2, static_cast<uint16_t>(height));
    expect_refused(bad, "allowed are", TileDecoder::Scope::Whole);
  }
  auto bad = whole_;
  set_u16(bad, 0, 199);
  expect_refused(bad, "shown is one of 200 x 100");
  bad = whole_;
  set_u16(bad, 4, 9);
  expect_refused(bad, "9 tiles for a picture of 8");
  set_u16(bad, 4, 7);
  expect_refused(bad, "7 tiles for a picture of 8", TileDecoder::Scope::Whole);
  expect_refused(bad, "bytes behind the last tile");
  expect_refused({}, "end in their header");
}

TEST_F(HostileTiles, PlacesQualitiesAndScansAreChecked) {
  const auto one = code(image_, 50, TileChroma::Halved, {3});
  auto bad = one;
  set_u16(bad, kTilesFixedBytes, 8);
  expect_refused(bad, "tile 8 after tile -1 of 8");
  const auto two = code(image_, 50, TileChroma::Halved, {2, 3});
  bad = two;
  set_u16(bad, kTilesFixedBytes, 3);
  expect_refused(bad, "tile 3 after tile 3");
  for (const int quality : {0, 101, 255}) {
    bad = one;
    bad[kTilesFixedBytes + 2] = static_cast<std::byte>(quality);
    expect_refused(bad, "a tile of quality");
  }
  bad = one;
  bad[kTilesFixedBytes + 3] = std::byte{2};
  expect_refused(bad, "chroma 2");
  bad = one;
  set_u16(bad, kTilesFixedBytes + 4, 0xffff);
  expect_refused(bad, "end in tile 0 of 1");
  bad = one;  // a restart marker: two tiles in one
  bad[kTilesFixedBytes + kTileHeaderBytes] = std::byte{0xff};
  bad[kTilesFixedBytes + kTileHeaderBytes + 1] = std::byte{0xd0};
  expect_refused(bad, "no scan of one tile");
  bad = one;  // the marker half in this tile, half made by what follows
  bad.back() = std::byte{0xff};
  expect_refused(bad, "no scan of one tile");
}

TEST_F(HostileTiles, DamageAnywhereNeverCrashesAndNeverLeavesHalfAPicture) {
  uint32_t seed = 1;
  const auto random = [&] { return seed = seed * 1664525u + 1013904223u, seed >> 8; };
  for (int round = 0; round < 3000; ++round) {
    auto bad = whole_;
    for (uint32_t i = 0; i <= random() % 3; ++i)
      bad[random() % bad.size()] = static_cast<std::byte>(random());
    if (random() % 4 == 0) bad.resize(random() % bad.size());
    TileDecoder decoder;
    Image canvas = before_;
    const auto scope = round % 2 == 0 ? TileDecoder::Scope::Changes : TileDecoder::Scope::Whole;
    const bool is_used = decoder.decode(bad, scope, canvas).ok();
    EXPECT_TRUE(is_used || canvas == before_) << round;
  }
}

}  // namespace
}  // namespace strandcast::jpeg_tiles_test

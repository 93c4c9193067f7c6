#include "common/base/file.h"
#include "common/pictures/jpeg_tiles.h"
#include "common/strands/byte_io.h"
#include "tests/conformance/payload_vectors.h"

namespace strandcast::conformance::payloads_test {
namespace {

/// The words of all lines of a kept file.
std::vector<std::vector<std::string>> lines_of(const std::string& name) {
  const auto text =
      load_text(std::filesystem::path(STRANDCAST_SOURCE_DIR) / "tests/conformance/vectors" / name, 1u << 20);
  EXPECT_TRUE(text) << text.error().to_string();
  std::vector<std::vector<std::string>> lines;
  std::istringstream stream(text ? *text : std::string());
  for (std::string line; std::getline(stream, line);) {
    std::istringstream words(line);
    lines.emplace_back(std::istream_iterator<std::string>(words), std::istream_iterator<std::string>());
  }
  EXPECT_FALSE(lines.empty());
  return lines;
}

TEST(Conformance, KeptAssetsHaveTheirContentAndAreMadeAlike) {
  for (const AssetLayout layout : {AssetLayout::Floats, AssetLayout::Numbers, AssetLayout::Form})
    for (const auto& words : lines_of(fmt::format("asset_{}.txt", static_cast<uint32_t>(layout)))) {
      ASSERT_EQ(words.size(), 3u);
      const Bytes payload = from_hex(words[2]).value();
      const auto asset = decode_scene_asset(payload);
      ASSERT_TRUE(asset) << asset.error().to_string();
      EXPECT_EQ(fmt::format("{:016x}", content_hash(*asset)), words[1]);
      EXPECT_TRUE(is_same_payload(encode_scene_asset(*asset, layout), payload))
          << "Assets are written otherwise than those that are kept: give the layout the next number "
             "(section 5 of "
             "proto/WIRE.md), and keep assets of it in a file of its own.";
    }
}

/// Takes the payload apart by the words of proto/WIRE.md, and puts the scans together again by the code.
Bytes packed_again(const Bytes& payload) {
  ByteReader reader(payload);
  const auto width = reader.take<uint16_t>();
  const auto height = reader.take<uint16_t>();
  std::vector<CodedTile> tiles(reader.take<uint16_t>());
  reader.take<uint16_t>();
  std::vector<PlacedTile> placed;
  for (CodedTile& tile : tiles) {
    placed.push_back({reader.take<uint16_t>(), &tile});
    tile.quality = reader.take<uint8_t>();
    tile.chroma = static_cast<TileChroma>(reader.take<uint8_t>());
    const auto scan = reader.take_bytes(reader.take<uint16_t>());
    tile.scan.assign(scan.begin(), scan.end());
  }
  EXPECT_TRUE(reader.ok() && reader.rest().empty());
  return pack_tiles(width, height, placed);
}

TEST(Conformance, KeptTilesShowTheirPictureAndArePackedAlike) {
  for (const auto& words : lines_of("tiles.txt")) {
    ASSERT_EQ(words.size(), 7u);
    const Bytes payload = from_hex(words[6]).value();
    Image canvas;
    const auto decoded = TileDecoder().decode(payload, TileDecoder::Scope::Whole, canvas);
    ASSERT_TRUE(decoded) << decoded.error().to_string();
    EXPECT_EQ(std::to_string(canvas.width), words[1]);
    EXPECT_EQ(std::to_string(canvas.height), words[2]);
    int farthest = 0;  // any colour, from what the picture was made of
    for (size_t i = 0; i < canvas.rgba.size(); ++i)
      if (i % 4 != 3) farthest = std::max(farthest, std::abs(canvas.rgba[i] - std::stoi(words[3 + i % 4])));
    // Conversions to YCbCr and back round once each; quality 95 quantises means in steps of 2 / 8.
    EXPECT_LE(farthest, 3);
    EXPECT_TRUE(packed_again(payload) == payload) << "Tiles are packed otherwise than those that are kept: "
                                                     "within strandcast.v1 they need an opcode of their own.";
  }
}

}  // namespace
}  // namespace strandcast::conformance::payloads_test

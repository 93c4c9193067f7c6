// Tiles: squares of a picture, coded as separate JPEG scans without headers, which would cost more than the
// pixels. A tile is the scan of a baseline JPEG of kTileSide x kTileSide pixels with the standard tables of
// its quality. Any number of tiles decode in one pass, as restart intervals of one tall picture. Layout of
// the payload in proto/WIRE.md. Objects belong to one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "common/pictures/image_codec.h"

namespace strandcast {

inline constexpr uint32_t kTileSide = 64;
inline constexpr size_t kTilesFixedBytes = 8;
inline constexpr size_t kTileHeaderBytes = 6;

/// Returns how many tiles cover `pixels` in one direction.
constexpr uint32_t tiles_along(uint32_t pixels) {
  return (pixels + kTileSide - 1) / kTileSide;
}

enum class TileChroma : uint8_t { Halved, Full };  // 4:2:0, 4:4:4

/// One coded tile, shared by all pictures in which it is unchanged.
struct CodedTile {
  uint8_t quality = 0;  // 1..100
  TileChroma chroma = TileChroma::Halved;
  std::vector<std::byte> scan;  // entropy-coded data, without markers
};

/// A tile with its index, counted row by row.
struct PlacedTile {
  uint16_t index = 0;
  const CodedTile* tile = nullptr;
};

/// Makes the payload of a JpegTiles message.
std::vector<std::byte> pack_tiles(uint32_t width, uint32_t height, std::span<const PlacedTile> tiles);

class TileEncoder {
 public:
  static Result<TileEncoder> make();

  /// Encodes the tile `index` of a valid image; beyond the image's edges its last pixels are repeated.
  Result<CodedTile> encode(const Image& image, uint32_t index, uint8_t quality, TileChroma chroma);

 private:
  struct FreeTurbo {
    void operator()(void* handle) const;
  };
  explicit TileEncoder(void* turbo) : turbo_(turbo) {}

  std::unique_ptr<void, FreeTurbo> turbo_;
  std::vector<uint8_t> padded_;
  std::vector<unsigned char> jpeg_;
};

class TileDecoder {
 public:
  /// Decodes an untrusted payload. Sizes, indices and every scan are checked before the canvas changes.
  /// Scope::Whole requires all tiles and resizes the canvas; Scope::Changes requires a canvas of the
  /// payload's size.
  enum class Scope { Changes, Whole };
  Status decode(std::span<const std::byte> payload, Scope scope, Image& canvas);

 private:
  struct Parsed {
    uint16_t index = 0;
    std::span<const std::byte> scan;
  };
  using Kind = std::pair<uint8_t, TileChroma>;
  Status decode_batch(const Kind& kind, std::span<const Parsed> tiles, std::span<uint8_t> pixels);
  Result<std::span<const std::byte>> header_of(const Kind& kind);

  struct FreeTurbo {
    void operator()(void* handle) const;
  };
  std::unique_ptr<void, FreeTurbo> turbo_;
  std::map<Kind, std::vector<std::byte>> headers_;  // of JPEGs of one tile, up to the scan
};

}  // namespace strandcast

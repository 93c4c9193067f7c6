// TileFrame: data that the stages of the tile renderer exchange for one picture. Allocated once and reused;
// no GL.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "common/pictures/image_codec.h"
#include "common/render/light_lattice.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

/// Side of a tile in pixels. It affects the picture, because strands are sorted per tile.
inline constexpr uint32_t kTilePx = 32;

/// A point of a drawn strand. Two successive points of one strand are a segment.
struct StrandPoint {
  float x, y, z;  // m, head space; once shaded: pixels from the top left, and metres along the view
  uint32_t unused;
  // Once shaded, as IEEE halves.
  std::array<uint16_t, 8> half;
};
static_assert(sizeof(StrandPoint) == 32);
enum StrandPointHalf : uint32_t { kMitreX, kMitreY, kWidthPx, kOpacity, kRed, kGreen, kBlue };

/// Points of drawn strands; `first_point` has one entry more than there are strands.
struct StrandPoints {
  std::vector<uint32_t> first_point;
  // Per strand: its number among all that could be drawn, and its lock; randomness hangs on these.
  std::vector<uint32_t> index;
  std::vector<uint32_t> lock;
  std::vector<StrandPoint> point;
  // Once shaded, per point: the only tile that the segment from there touches, or one of these.
  std::vector<uint32_t> tile;
  static constexpr uint32_t kNoTile = 0xffffffffu;
  static constexpr uint32_t kSeveralTiles = 0xfffffffeu;  // or not known

  uint32_t strand_count() const {
    return first_point.empty() ? 0 : static_cast<uint32_t>(first_point.size() - 1);
  }
  uint64_t size_bytes() const {
    return (first_point.capacity() + index.capacity() + lock.capacity() + tile.capacity()) *
               sizeof(uint32_t) +
           point.capacity() * sizeof(StrandPoint);
  }
};

}  // namespace strandcast

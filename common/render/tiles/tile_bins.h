// Which segments, and which triangles of the head, touch which tile of a picture. Lists are in the order of
// the segments, whatever the number of threads. No GL.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <vector>

#include "common/base/worker_pool.h"
#include "common/render/tiles/tile_frame.h"

namespace strandcast {

/// Pairs of a segment and a tile in one picture, at most; more, and strands are left out evenly.
inline constexpr size_t kMaxTilePairs = size_t{1} << 23;

struct TileGrid {
  glm::uvec2 size_px{0};
  uint32_t columns() const { return (size_px.x + kTilePx - 1) / kTilePx; }
  uint32_t rows() const { return (size_px.y + kTilePx - 1) / kTilePx; }
  uint32_t count() const { return columns() * rows(); }
};

/// A segment in a tile: the depths of its two ends, summed, and its first point.
struct TileSegment {
  float depth;
  uint32_t point;
};

/// Tile i has item[first[i]] up to item[first[i + 1]]; `first` has one entry more than there are tiles.
template <class Item>
struct TileLists {
  std::vector<uint32_t> first;
  std::vector<Item> item;
  uint64_t size_bytes() const { return first.capacity() * sizeof(uint32_t) + item.capacity() * sizeof(Item); }
};

struct BinCounts {
  uint64_t segments = 0;    // on the picture
  uint64_t left_out = 0;    // strands, for lack of room
  uint64_t not_finite = 0;  // segments with a position that is no number
};

class TileBins {
 public:
  /// Segments by the index of their first point. Behind `near_m` nothing is drawn.
  BinCounts bin_segments(const StrandPoints& points, const TileGrid& grid, float near_m, WorkerPool& workers);
  /// Boxes (low x, low y, high x, high y) in pixels; an empty one is in no tile.
  void bin_boxes(const std::vector<glm::vec4>& boxes, const TileGrid& grid);

  const TileLists<TileSegment>& segments() const { return segments_; }
  const TileLists<uint32_t>& boxes() const { return boxes_; }
  uint64_t size_bytes() const;

 private:
  TileLists<TileSegment> segments_;
  TileLists<uint32_t> boxes_;
  std::vector<uint32_t> counts_;  // (part x tile)
};

}  // namespace strandcast

// TileBins: lists of the segments, and of the head's triangles, that touch each tile of a picture. Lists are
// in the order of the segments for any number of threads. No GL.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <vector>

#include "common/base/worker_pool.h"
#include "common/render/tiles/tile_frame.h"

namespace strandcast {

/// Largest number of (segment, tile) pairs in one picture; beyond it strands are evenly left out.
inline constexpr size_t kMaxTilePairs = size_t{1} << 23;

struct TileGrid {
  glm::uvec2 size_px{0};
  uint32_t columns() const { return (size_px.x + kTilePx - 1) / kTilePx; }
  uint32_t rows() const { return (size_px.y + kTilePx - 1) / kTilePx; }
  uint32_t count() const { return columns() * rows(); }
};

/// A segment in a tile: the sum of the depths of its ends, and its first point.
struct TileSegment {
  float depth;
  uint32_t point;
};

/// Lists of all tiles: tile i has item[first[i]] up to item[first[i + 1]], exclusive. `first` has one entry
/// more than there are tiles.
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
  /// Sorts segments, by the index of their first point, into tiles. Segments nearer than `near_m` are not
  /// drawn.
  BinCounts bin_segments(const StrandPoints& points, const TileGrid& grid, float near_m, WorkerPool& workers);
  /// Sorts boxes (low x, low y, high x, high y; pixels) into tiles; an empty box is in no tile.
  void bin_boxes(const std::vector<glm::vec4>& boxes, const TileGrid& grid);

  const TileLists<TileSegment>& segments() const { return segments_; }
  const TileLists<uint32_t>& boxes() const { return boxes_; }
  uint64_t size_bytes() const;

 private:
  struct Cut {
    const TileGrid& grid;
    float near_m;
  };
  /// Fills counts_ and returns their sum.
  size_t count_segments(const StrandPoints& points, const Cut& cut, uint32_t drawn, WorkerPool& workers,
                        std::vector<BinCounts>& counted);

  TileLists<TileSegment> segments_;
  TileLists<uint32_t> boxes_;
  std::vector<uint32_t> counts_;  // (part x tile)
};

}  // namespace strandcast

#include "common/render/tiles/tile_bins.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/render/tiles/half_float.h"

namespace strandcast {
namespace {

struct TileRange {
  int x0, x1, y0, y1;  // inclusive
  bool is_empty() const { return x0 > x1 || y0 > y1; }
};

constexpr uint32_t kPartsPerWorker = 4;
constexpr float kPerTile = 1.0f / static_cast<float>(kTilePx);

/// Towards minus infinity, of values that fit.
int floor_of(float x) {
  const int cut = static_cast<int>(x);
  return cut - (static_cast<float>(cut) > x ? 1 : 0);
}

/// Calls visit(tile) for each tile that a segment touches at its drawn width.
template <class Visit>
bool visit_tiles(const StrandPoint& a, const StrandPoint& b, const TileGrid& grid, float near_m,
                 Visit visit) {
  const float width = std::max(float_of_half(a.half[kWidthPx]), float_of_half(b.half[kWidthPx]));
  constexpr float kHalfDiagonalPx = 0.70710678f;  // of a pixel
  const float reach = 0.5f * width + kHalfDiagonalPx;
  const float low_x = std::min(a.x, b.x) - reach;
  const float high_x = std::max(a.x, b.x) + reach;
  const float low_y = std::min(a.y, b.y) - reach;
  const float high_y = std::max(a.y, b.y) + reach;
  // Also false for what is no number.
  constexpr float kFarPx = 1e7f;
  const bool is_near = std::abs(a.x) + std::abs(a.y) + std::abs(b.x) + std::abs(b.y) < kFarPx;
  const bool is_seen = is_near && a.z > near_m && b.z > near_m && high_x > 0.0f && high_y > 0.0f &&
                       low_x < static_cast<float>(grid.size_px.x) &&
                       low_y < static_cast<float>(grid.size_px.y) && (a.x != b.x || a.y != b.y);
  if (!is_seen) return false;
  const int columns = static_cast<int>(grid.columns());
  const int x0 = low_x > 0.0f ? static_cast<int>(low_x * kPerTile) : 0;
  const int y0 = low_y > 0.0f ? static_cast<int>(low_y * kPerTile) : 0;
  const int x1 = std::min(columns - 1, static_cast<int>(std::min(high_x * kPerTile, 1e6f)));
  const int y1 =
      std::min(static_cast<int>(grid.rows()) - 1, static_cast<int>(std::min(high_y * kPerTile, 1e6f)));
  if (x0 == x1 || y0 == y1) {
    for (int y = y0; y <= y1; ++y)
      for (int x = x0; x <= x1; ++x) visit(static_cast<uint32_t>(y * columns + x));
    return true;
  }
  // A slanted line leaves out most tiles of its box: those that lie wholly to one side of it.
  const float dx = b.x - a.x;
  const float dy = b.y - a.y;
  const float size = 1.0f / std::sqrt(dx * dx + dy * dy);
  const float nx = -dy * size;
  const float ny = dx * size;
  const float offset = nx * a.x + ny * a.y;
  const float room = reach + 0.5f * static_cast<float>(kTilePx) * (std::abs(nx) + std::abs(ny));
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x) {
      const float middle_x = (static_cast<float>(x) + 0.5f) * static_cast<float>(kTilePx);
      const float middle_y = (static_cast<float>(y) + 0.5f) * static_cast<float>(kTilePx);
      if (std::abs(nx * middle_x + ny * middle_y - offset) <= room)
        visit(static_cast<uint32_t>(y * columns + x));
    }
  return true;
}

/// Calls work(part, segment, its tile) for each segment of what is drawn, by parts.
template <class Work>
void for_segments(const StrandPoints& points, uint32_t parts, uint32_t drawn, WorkerPool& workers,
                  Work work) {
  const uint32_t strands = points.strand_count();
  workers.at(Priority::Drawing).for_ranges(parts, 1, [&](size_t begin_part, size_t) {
    const auto part = static_cast<uint32_t>(begin_part);
    const auto begin = static_cast<uint32_t>(uint64_t{strands} * part / parts);
    const auto end = static_cast<uint32_t>(uint64_t{strands} * (part + 1) / parts);
    for (uint32_t strand = begin; strand < end; ++strand) {
      // Of those that do not all fit every so many-th is left out.
      if (drawn < strands && (uint64_t{strand} + 1) * drawn / strands == uint64_t{strand} * drawn / strands)
        continue;
      for (uint32_t i = points.first_point[strand]; i + 1 < points.first_point[strand + 1]; ++i) {
        const uint32_t only = points.tile.empty() ? StrandPoints::kSeveralTiles : points.tile[i];
        if (only != StrandPoints::kNoTile) work(part, i, only);
      }
    }
  });
}

}  // namespace

uint64_t TileBins::size_bytes() const {
  return segments_.size_bytes() + boxes_.size_bytes() + counts_.capacity() * sizeof(uint32_t);
}

size_t TileBins::count_segments(const StrandPoints& points, const Cut& cut, uint32_t drawn,
                                WorkerPool& workers, std::vector<BinCounts>& counted) {
  const uint32_t tiles = cut.grid.count();
  const auto parts = static_cast<uint32_t>(counted.size());
  counts_.assign(size_t{tiles} * parts, 0);
  for (BinCounts& counts : counted) counts = {};
  for_segments(points, parts, drawn, workers, [&](uint32_t part, uint32_t i, uint32_t only) {
    uint32_t* const counts = counts_.data() + size_t{tiles} * part;
    BinCounts& sum = counted[part];
    if (only != StrandPoints::kSeveralTiles) {
      ++counts[only];
      ++sum.segments;
      return;
    }
    const StrandPoint& a = points.point[i];
    const StrandPoint& b = points.point[i + 1];
    if (visit_tiles(a, b, cut.grid, cut.near_m, [&](uint32_t tile) { ++counts[tile]; }))
      ++sum.segments;
    else if (!(std::isfinite(a.x + b.x) && std::isfinite(a.y + b.y) && std::isfinite(a.z + b.z)))
      ++sum.not_finite;
  });
  size_t pairs = 0;
  for (const uint32_t count : counts_) pairs += count;
  return pairs;
}

BinCounts TileBins::bin_segments(const StrandPoints& points, const TileGrid& grid, float near_m,
                                 WorkerPool& workers) {
  const uint32_t tiles = grid.count();
  // More than threads: who is held up leaves some to the others. Each part is a run of strands, so that the
  // lists come out in their order.
  const uint32_t parts = workers.size() > 1 ? kPartsPerWorker * workers.size() : 1;
  const uint32_t strands = points.strand_count();
  std::vector<BinCounts> counted(parts);
  uint32_t drawn = strands;
  for (;;) {
    const size_t pairs = count_segments(points, {grid, near_m}, drawn, workers, counted);
    if (pairs <= kMaxTilePairs || drawn == 0) break;
    drawn = static_cast<uint32_t>(static_cast<double>(drawn) * 0.9 * static_cast<double>(kMaxTilePairs) /
                                  static_cast<double>(pairs));
  }
  segments_.first.resize(size_t{tiles} + 1);
  uint32_t next = 0;
  for (uint32_t tile = 0; tile < tiles; ++tile) {
    segments_.first[tile] = next;
    for (uint32_t part = 0; part < parts; ++part)
      next += std::exchange(counts_[size_t{tiles} * part + tile], next);
  }
  segments_.first[tiles] = next;
  segments_.item.resize(next);
  for_segments(points, parts, drawn, workers, [&](uint32_t part, uint32_t i, uint32_t only) {
    uint32_t* const places = counts_.data() + size_t{tiles} * part;
    const StrandPoint& a = points.point[i];
    const StrandPoint& b = points.point[i + 1];
    const auto put = [&](uint32_t tile) { segments_.item[places[tile]++] = {a.z + b.z, i}; };
    if (only != StrandPoints::kSeveralTiles) return put(only);
    visit_tiles(a, b, grid, near_m, put);
  });
  BinCounts sum;
  for (const BinCounts& counts : counted) {
    sum.segments += counts.segments;
    sum.not_finite += counts.not_finite;
  }
  sum.left_out = strands - drawn;
  return sum;
}

void TileBins::bin_boxes(const std::vector<glm::vec4>& boxes, const TileGrid& grid) {
  const auto range_of = [&](const glm::vec4& box) -> TileRange {
    if (!(box.x <= box.z && box.y <= box.w && box.z >= 0.0f && box.w >= 0.0f &&
          box.x < static_cast<float>(grid.size_px.x) && box.y < static_cast<float>(grid.size_px.y)))
      return {0, -1, 0, -1};
    const auto tile_at = [](float x, uint32_t count) {
      return std::clamp(floor_of(std::clamp(x * kPerTile, -1.0f, 1e6f)), 0, static_cast<int>(count) - 1);
    };
    return {tile_at(box.x, grid.columns()), tile_at(box.z, grid.columns()), tile_at(box.y, grid.rows()),
            tile_at(box.w, grid.rows())};
  };
  const auto visit = [&](auto work) {
    for (uint32_t i = 0; i < boxes.size(); ++i) {
      const TileRange range = range_of(boxes[i]);
      for (int y = range.y0; y <= range.y1; ++y)
        for (int x = range.x0; x <= range.x1; ++x) work(i, static_cast<uint32_t>(y) * grid.columns() + x);
    }
  };
  boxes_.first.assign(size_t{grid.count()} + 1, 0);
  visit([&](uint32_t, uint32_t tile) { ++boxes_.first[tile + 1]; });
  for (uint32_t tile = 0; tile < grid.count(); ++tile) boxes_.first[tile + 1] += boxes_.first[tile];
  boxes_.item.resize(boxes_.first.back());
  std::vector<uint32_t> place(boxes_.first.begin(), boxes_.first.end() - 1);
  visit([&](uint32_t box, uint32_t tile) { boxes_.item[place[tile]++] = box; });
}

}  // namespace strandcast

// Blends a tile's segments front to back, for the kernel of tile_raster.cpp. The set-up of a segment is
// computed for eight of them at once; then each is blended into the pixel blocks that it can reach.
// Everything is inlined.
#pragma once

#include <algorithm>
#include <bit>
#include <cstring>

#include "common/render/laws.h"
#include "common/render/tiles/tile_frame.h"

namespace strandcast {

// Pixels that a vector holds. Hair hangs, so blocks are higher than wide.
inline constexpr int kBlockColumns = 2;
inline constexpr int kBlockRows = 4;
static_assert(kBlockColumns * kBlockRows == simd::kLanes);
inline constexpr int kTileSidePx = static_cast<int>(kTilePx);
inline constexpr int kBlocksAcross = kTileSidePx / kBlockColumns;
inline constexpr int kBlocksDown = kTileSidePx / kBlockRows;
inline constexpr int kBlocks = kBlocksAcross * kBlocksDown;
// Light that still passes when a pixel counts as opaque.
inline constexpr float kOpaque = 1.0f / 300.0f;
// Strands this far behind the skin are still in front of it: roots stand in it.
inline constexpr float kSkinDepthM = 0.0005f;

/// Colour and opacity of one tile's pixels.
struct TilePixels {
  simd::Float red[kBlocks];
  simd::Float green[kBlocks];
  simd::Float blue[kBlocks];
  simd::Float passed[kBlocks];  // share of what lies behind that is still seen
  // Per row of blocks, a bit for each that something can still be blended into.
  uint32_t open[kBlocksDown];
};
struct TileHead {
  simd::Float depth[kBlocks];  // m, nearest
  simd::Float seen[kBlocks];   // share of the pixel that is head and has no strand in front of it yet
  float hides[kBlocks];        // m: nothing of what lies wholly beyond this is seen in the block
  float hides_all;             // likewise in the whole tile
  float end;                   // m: behind all that is head in the tile
};
inline constexpr float kNothingHidden = 1e30f;

/// Finds the blocks that the head covers entirely, and how far back the head reaches.
STRANDCAST_LANES void find_hidden(TileHead& head) {
  constexpr float kRounding = 1e-5f;  // of a depth between two ends
  constexpr float kNoHead = 1e29f;    // from here on depths are of nothing
  head.hides_all = 0.0f;
  head.end = 0.0f;
  for (int block = 0; block < kBlocks; ++block) {
    float farthest = head.depth[block].v[0];
    for (uint32_t lane = 1; lane < simd::kLanes; ++lane)
      farthest = std::max(farthest, head.depth[block].v[lane]);
    const bool is_covered = !is_any(head.seen[block] < 1.0f);
    head.hides[block] = is_covered ? farthest + kSkinDepthM + kRounding : kNothingHidden;
    head.hides_all = std::max(head.hides_all, head.hides[block]);
    for (uint32_t lane = 0; lane < simd::kLanes; ++lane)
      if (head.depth[block].v[lane] < kNoHead) head.end = std::max(head.end, head.depth[block].v[lane]);
  }
}

STRANDCAST_LANES simd::Float block_columns() {
  return simd::FloatBits{0.5f, 1.5f, 0.5f, 1.5f, 0.5f, 1.5f, 0.5f, 1.5f};
}
STRANDCAST_LANES simd::Float block_rows() {
  return simd::FloatBits{0.5f, 0.5f, 1.5f, 1.5f, 2.5f, 2.5f, 3.5f, 3.5f};
}

/// Returns the seven half floats of a point as floats, in their order.
STRANDCAST_LANES simd::Float values_of(const StrandPoint& point) {
  using HalfBits = uint16_t __attribute__((vector_size(16)));
  HalfBits half;
  std::memcpy(&half, point.half.data(), sizeof half);
  constexpr float kFloatScale = 5.19229686e33f;  // as float_of_half
  const simd::UintBits bits = __builtin_convertvector(half, simd::UintBits);
  const simd::FloatBits size = (simd::FloatBits)((bits & 0x7fffu) << 13) * kFloatScale;
  return (simd::FloatBits)((simd::UintBits)size | (bits & 0x8000u) << 16);
}

/// Eight segments prepared for blending. Distances are linear functions of a pixel's centre (x, y), relative
/// to the tile's corner: x * [0] + y * [1] + [2].
struct SegmentBatch {
  using Row = float[simd::kLanes];
  Row across[3];    // from the line, px
  Row along[3];     // 0 at the first end, 1 at the second
  Row behind_a[3];  // positive beyond the mitre of an end
  Row behind_b[3];
  Row beyond;  // an end nothing is covered further than this, as `along`: sharp bends have long mitres
  Row base, slope, peak;  // of the filter, per width
  Row width, width_step;
  Row depth, depth_step;
  Row low_y, high_y;  // of middles of pixels that can be covered
  // Of columns of blocks: where what the line covers begins and ends in the first row of blocks, how far from
  // row to row, and where it begins and ends in all.
  Row first, last, per_row, lowest, highest;
  float value[simd::kLanes][8];  // at the first end
  float step[simd::kLanes][8];   // from there to the second
};

/// Returns the slant of a mitre along a segment, per distance from it.
STRANDCAST_LANES simd::Float lean_of(law::vec2 mitre, law::vec2 way) {
  constexpr float kLeast = 1e-3f;
  constexpr float kMost = 1e3f;
  const simd::Float facing = dot(mitre, way);
  const simd::Float aside = simd::abs(mitre.x * way.y - mitre.y * way.x);
  return select(facing > kLeast, aside / simd::max(facing, kLeast), kMost);
}

STRANDCAST_LANES void place_segments(const StrandPoint* points, const uint64_t* order, uint32_t count,
                                     float tile_x, float tile_y, SegmentBatch& out) {
  using namespace law;
  float ends[6][kLanes];
  float mitre[4][kLanes];
  float width[2][kLanes];
  for (uint32_t lane = 0; lane < kLanes; ++lane) {
    const StrandPoint* const a = points + static_cast<uint32_t>(order[lane < count ? lane : count - 1]);
    const StrandPoint* const b = a + 1;
    ends[0][lane] = a->x;
    ends[1][lane] = a->y;
    ends[2][lane] = a->z;
    ends[3][lane] = b->x;
    ends[4][lane] = b->y;
    ends[5][lane] = b->z;
    const Float va = values_of(*a);
    const Float vb = values_of(*b);
    store_lanes(va, out.value[lane]);
    store_lanes(vb - va, out.step[lane]);
    mitre[0][lane] = va.v[kMitreX];
    mitre[1][lane] = va.v[kMitreY];
    mitre[2][lane] = vb.v[kMitreX];
    mitre[3][lane] = vb.v[kMitreY];
    width[0][lane] = va.v[kWidthPx];
    width[1][lane] = vb.v[kWidthPx];
  }
  const Float ax = load_lanes(ends[0]) - tile_x;
  const Float ay = load_lanes(ends[1]) - tile_y;
  const Float bx = load_lanes(ends[3]) - tile_x;
  const Float by = load_lanes(ends[4]) - tile_y;
  const Float dx = bx - ax;
  const Float dy = by - ay;
  const Float per_length2 = 1.0f / (dx * dx + dy * dy);
  const Float per_length = sqrt(per_length2);
  const Float ux = dx * per_length;
  const Float uy = dy * per_length;
  store_lanes(uy, out.across[0]);
  store_lanes(-ux, out.across[1]);
  store_lanes(ay * ux - ax * uy, out.across[2]);
  const Float along_x = dx * per_length2;
  const Float along_y = dy * per_length2;
  store_lanes(along_x, out.along[0]);
  store_lanes(along_y, out.along[1]);
  store_lanes(-(ax * along_x + ay * along_y), out.along[2]);

  // Joints: a pixel belongs to the segment between the mitres of its ends, computed alike on both sides of
  // one.
  const Float mitre_ax = load_lanes(mitre[0]);
  const Float mitre_ay = load_lanes(mitre[1]);
  const Float mitre_bx = load_lanes(mitre[2]);
  const Float mitre_by = load_lanes(mitre[3]);
  store_lanes(mitre_ax, out.behind_a[0]);
  store_lanes(mitre_ay, out.behind_a[1]);
  store_lanes(-(ax * mitre_ax + ay * mitre_ay), out.behind_a[2]);
  store_lanes(mitre_bx, out.behind_b[0]);
  store_lanes(mitre_by, out.behind_b[1]);
  store_lanes(-(bx * mitre_bx + by * mitre_by), out.behind_b[2]);

  // The filter of the middle, times the width where it is: coverage adds up to the width all along.
  const Float wa = load_lanes(width[0]);
  const Float wb = load_lanes(width[1]);
  const Float mean_width = max(0.5f * (wa + wb), 1e-4f);
  const LineFilter filter = line_filter(mean_width, vec2(ux, uy));
  const Float per_width = 1.0f / mean_width;
  store_lanes(filter.base * per_width, out.base);
  store_lanes(filter.slope * per_width, out.slope);
  store_lanes(filter.peak * per_width, out.peak);
  store_lanes(wa, out.width);
  store_lanes(wb - wa, out.width_step);
  store_lanes(load_lanes(ends[2]), out.depth);
  store_lanes(load_lanes(ends[5]) - load_lanes(ends[2]), out.depth_step);

  // What is covered lies within `reach` of the line, and reaches beyond an end no further than a mitre leans.
  const Float reach = filter.reach;
  store_lanes(reach * per_length, out.beyond);
  const vec2 way(ux, uy);
  const Float beyond =
      reach * max(lean_of(vec2(mitre_ax, mitre_ay), way), lean_of(vec2(mitre_bx, mitre_by), way));
  constexpr float kSlack = 1e-3f;
  const Float aside_x = min(reach * abs(uy) + beyond * abs(ux), reach) + kSlack;
  const Float aside_y = min(reach * abs(ux) + beyond * abs(uy), reach) + kSlack;
  store_lanes(min(ay, by) - aside_y, out.low_y);
  store_lanes(max(ay, by) + aside_y, out.high_y);
  // Of a line that is not level the pixels of a row lie close around it.
  constexpr float kLevel = 0.02f;
  constexpr float kWholeTile = 1e4f;
  const Float steepness = abs(uy);
  const Bool is_level = steepness < kLevel;
  const Float x_per_y = select(is_level, 0.0f, dx / select(is_level, 1.0f, dy));
  const Float room = select(is_level, kWholeTile, reach / max(steepness, kLevel) + kSlack);
  // From the middles of the first row of pixels in a block to those of the last.
  const Float x_first = ax + (0.5f - ay) * x_per_y;
  const Float x_last = x_first + static_cast<float>(kBlockRows - 1) * x_per_y;
  constexpr float kPerColumn = 1.0f / static_cast<float>(kBlockColumns);
  store_lanes((min(x_first, x_last) - room + 0.5f) * kPerColumn, out.first);
  store_lanes((max(x_first, x_last) + room - 0.5f) * kPerColumn, out.last);
  store_lanes(x_per_y * (kPerColumn * static_cast<float>(kBlockRows)), out.per_row);
  store_lanes(max((min(ax, bx) - aside_x + 0.5f) * kPerColumn, 0.0f), out.lowest);
  store_lanes(min((max(ax, bx) + aside_x - 0.5f) * kPerColumn, static_cast<float>(kBlocksAcross - 1)),
              out.highest);
}

/// Returns the first block whose last pixel centre is at or above `low`, for blocks of `side` pixels.
STRANDCAST_LANES int first_block(float low, int side) {
  // The last middle of a block lies half a pixel before its end.
  const float at = (low + 0.5f) * (1.0f / static_cast<float>(side));
  return at > 0.0f ? static_cast<int>(at) : 0;
}
/// Returns the last block that has a pixel centre at or below `high`, for blocks of `side` pixels; negative
/// for none.
STRANDCAST_LANES int last_block(float high, int side, int blocks) {
  const float at = (high - 0.5f) * (1.0f / static_cast<float>(side));
  if (at >= static_cast<float>(blocks)) return blocks - 1;
  return at >= 0.0f ? static_cast<int>(at) : -1;
}

/// Blends one segment of a batch under what is already in front of it.
STRANDCAST_LANES void blend_segment(const SegmentBatch& s, uint32_t i, TileHead* head, TilePixels& pixels) {
  using simd::Bool;
  using simd::Float;
  const float* const va = s.value[i];
  const float* const step = s.step[i];
  const Float cx = block_columns();
  const Float cy = block_rows();
  const float nearest = std::min(s.depth[i], s.depth[i] + s.depth_step[i]);
  const bool fades = step[kOpacity] != 0.0f || va[kOpacity] != 1.0f;
  const int y1 = last_block(s.high_y[i], kBlockRows, kBlocksDown);
  for (int y = first_block(s.low_y[i], kBlockRows); y <= y1; ++y) {
    const auto top = static_cast<float>(y * kBlockRows);
    const float moved = static_cast<float>(y) * s.per_row[i];
    const float from = std::max(s.lowest[i], s.first[i] + moved);
    const float to = std::min(s.highest[i], s.last[i] + moved);
    // Also where one is no number.
    if (!(to >= 0.0f && from < static_cast<float>(kBlocksAcross))) continue;
    const auto x0 = static_cast<int>(from);
    const auto x1 = static_cast<int>(to);
    if (x0 > x1) continue;
    uint32_t left = pixels.open[y] & (~0u << x0) & (~0u >> (31 - x1));
    if (left == 0) continue;
    const Float py = cy + top;
    const Float row_across = py * s.across[1][i] + s.across[2][i];
    const Float row_along = py * s.along[1][i] + s.along[2][i];
    const Float row_behind_a = py * s.behind_a[1][i] + s.behind_a[2][i];
    const Float row_behind_b = py * s.behind_b[1][i] + s.behind_b[2][i];
    for (; left != 0; left &= left - 1) {
      const int x = std::countr_zero(left);
      if (head != nullptr && nearest > head->hides[y * kBlocksAcross + x]) continue;
      const Float px = cx + static_cast<float>(x * kBlockColumns);
      const Float across = px * s.across[0][i] + row_across;
      const Float along = px * s.along[0][i] + row_along;
      const Float part = simd::clamp(along, 0.0f, 1.0f);
      // shaders/lib/coverage.glsl
      const Float cover = simd::min(simd::min(s.base[i] - s.slope[i] * simd::abs(across), s.peak[i]) *
                                        (s.width[i] + part * s.width_step[i]),
                                    1.0f);
      const Float behind_a = px * s.behind_a[0][i] + row_behind_a;
      const Float behind_b = px * s.behind_b[0][i] + row_behind_b;
      const Bool is_mine =
          behind_a >= 0.0f && behind_b < 0.0f && simd::abs(along - part) <= s.beyond[i] && cover > 0.0f;
      const int block = y * kBlocksAcross + x;
      const Float opacity = fades ? cover * (va[kOpacity] + part * step[kOpacity]) : cover;
      Float open = pixels.passed[block];
      if (head != nullptr) {
        // Behind the head there is only what it leaves of the pixel; in front of it a strand hides both
        // alike.
        const Float z = s.depth[i] + part * s.depth_step[i];
        const Float seen = head->seen[block];
        const Bool is_front = z < head->depth[block] + kSkinDepthM;
        head->seen[block] -= simd::FloatBits((simd::IntBits)(seen * opacity).v & is_mine.v & is_front.v);
        open = select(is_front, open, open - seen);
      }
      const Float share = simd::FloatBits((simd::IntBits)(open * opacity).v & is_mine.v);
      pixels.red[block] += share * (va[kRed] + part * step[kRed]);
      pixels.green[block] += share * (va[kGreen] + part * step[kGreen]);
      pixels.blue[block] += share * (va[kBlue] + part * step[kBlue]);
      pixels.passed[block] -= share;
    }
  }
}

/// Marks opaque blocks as closed and returns whether any is still open. `head` is given if all later segments
/// lie behind it; else null.
STRANDCAST_LANES bool close_opaque_blocks(const TileHead* head, TilePixels& pixels) {
  uint32_t any = 0;
  for (int y = 0; y < kBlocksDown; ++y) {
    for (uint32_t left = pixels.open[y]; left != 0; left &= left - 1) {
      const int x = std::countr_zero(left);
      const int block = y * kBlocksAcross + x;
      const simd::Float open =
          head != nullptr ? pixels.passed[block] - head->seen[block] : pixels.passed[block];
      if (!is_any(open > kOpaque)) pixels.open[y] &= ~(1u << x);
    }
    any |= pixels.open[y];
  }
  return any != 0;
}

}  // namespace strandcast

// Where each tile's list begins, and how many segments there are in all; one group.
#include "render/tile_frame.glsl"

layout(local_size_x = kOffsetLocalSize) in;

layout(std430, binding = kBindingTileCounts) restrict buffer TileCounts {
  uint count[];   // (tiles) segments; then where the list begins
} b_counts;
layout(std430, binding = kBindingTileFirst) restrict writeonly buffer TileFirst {
  uint first[];   // (tiles + 1)
} b_first;
layout(std430, binding = kBindingTileTotals) restrict buffer TileTotals {
  uint total[];   // kTotal* (shared/tiles.h)
} b_totals;

shared uint s_sum[kOffsetLocalSize];

void main() {
  uint tiles = u_frame.grid.x * u_frame.grid.y;
  uint per_invocation = (tiles + kOffsetLocalSize - 1u) / kOffsetLocalSize;
  uint me = gl_LocalInvocationID.x;
  uint begin = min(me * per_invocation, tiles);
  uint end = min(begin + per_invocation, tiles);
  uint sum = 0u;
  for (uint tile = begin; tile < end; ++tile) sum += b_counts.count[tile];
  s_sum[me] = sum;
  barrier();
  uint next = 0u;
  for (uint i = 0u; i < me; ++i) next += s_sum[i];
  for (uint tile = begin; tile < end; ++tile) {
    uint count = b_counts.count[tile];
    b_first.first[tile] = next;
    b_counts.count[tile] = next;
    next += count;
  }
  if (me == kOffsetLocalSize - 1u) {
    b_first.first[tiles] = next;
    b_totals.total[kTotalPairs] = next;
    b_totals.total[kTotalFullTiles + 1u] = 1u;
    b_totals.total[kTotalFullTiles + 2u] = 1u;
  }
}

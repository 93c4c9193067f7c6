// The segments of a full tile from front to back, as tile_order.comp: runs are merged two by two, each invocation an equal
// share of what comes out, found by where the diagonal crosses the path of the merge (Green et al. 2012). So that no
// invocation makes many turns. One group per tile.
#include "render/tile_frame.glsl"
#include "render/tile_pairs.glsl"

layout(local_size_x = kMergeLocalSize) in;

layout(binding = kUnitTileFirst) uniform usamplerBuffer u_first;   // (tiles + 1)
layout(std430, binding = kBindingTileGrouped) restrict coherent buffer TileGrouped {
  uvec2 pair[];
} b_grouped;
layout(std430, binding = kBindingTilePairs) restrict coherent buffer TilePairs {
  uvec2 pair[];   // unordered at first, in order in the end
} b_pairs;
layout(std430, binding = kBindingTileFull) restrict readonly buffer TilesFull {
  uint tile[];
} b_full;

uvec2 pair_at(uint i, bool is_back) {
  if (is_back) return b_grouped.pair[i];
  return b_pairs.pair[i];
}

// Of the first `count` that two runs merge to, how many come from the first run.
uint from_first(uint first, uint first_size, uint second, uint second_size, uint count, bool is_back) {
  uint low = count > second_size ? count - second_size : 0u;
  uint high = min(count, first_size);
  while (low < high) {
    uint middle = (low + high) / 2u;
    if (is_before(pair_at(first + middle, is_back), pair_at(second + count - 1u - middle, is_back)))
      low = middle + 1u;
    else
      high = middle;
  }
  return low;
}

// Of the tile, what comes out between `at` and `end`.
void merge_share(uint begin, uint size, uint run, uint at, uint end, bool is_back) {
  uint first = 0u, second = 0u, first_end = 0u, second_end = 0u;
  bool is_new = true;
  for (; at < end; ++at) {
    if (is_new || at % (2u * run) == 0u) {
      uint start = at - at % (2u * run);
      first_end = min(start + run, size);
      second_end = min(start + 2u * run, size);
      uint taken = from_first(begin + start, first_end - start, begin + first_end, second_end - first_end, at - start, is_back);
      first = start + taken;
      second = first_end + (at - start - taken);
      is_new = false;
    }
    bool is_first = first < first_end;
    if (is_first && second < second_end)
      is_first = is_before(pair_at(begin + first, is_back), pair_at(begin + second, is_back));
    uvec2 pair = pair_at(begin + (is_first ? first : second), is_back);
    first += is_first ? 1u : 0u;
    second += is_first ? 0u : 1u;
    if (is_back)
      b_pairs.pair[begin + at] = pair;
    else
      b_grouped.pair[begin + at] = pair;
  }
}

void main() {
  uint tile = b_full.tile[gl_WorkGroupID.x];
  uint begin = texelFetch(u_first, int(tile)).r;
  uint size = texelFetch(u_first, int(tile + 1u)).r - begin;
  uint share = (size + kMergeLocalSize - 1u) / kMergeLocalSize;
  uint at = min(gl_LocalInvocationID.x * share, size);
  uint end = min(at + share, size);
  // There and back again, so that it ends where it began.
  for (uint run = 1u; run < size; run *= 4u) {
    merge_share(begin, size, run, at, end, false);
    memoryBarrierBuffer();
    barrier();
    merge_share(begin, size, 2u * run, at, end, true);
    memoryBarrierBuffer();
    barrier();
  }
}

// The segments of a tile from front to back, by depth and then by number, so that the order in which they came does not
// matter: put into steps of depth by counting, then each step ordered by itself. One group per tile. Tiles with a full step
// are left to tile_merge.comp.
#include "render/tile_frame.glsl"
#include "render/tile_pairs.glsl"

layout(local_size_x = kOrderLocalSize) in;

layout(binding = kUnitTileFirst) uniform usamplerBuffer u_first;   // (tiles + 1)
layout(binding = kUnitTilePairs) uniform usamplerBuffer u_pairs;   // depth, first point
layout(std430, binding = kBindingTileGrouped) restrict coherent buffer TileGrouped {
  uvec2 pair[];
} b_grouped;
layout(std430, binding = kBindingTilePairs) restrict writeonly buffer TilePairs {
  uvec2 pair[];
} b_pairs;
layout(std430, binding = kBindingTileTotals) restrict buffer TileTotals {
  uint total[];   // kTotal* (shared/tiles.h)
} b_totals;
layout(std430, binding = kBindingTileFull) restrict writeonly buffer TilesFull {
  uint tile[];
} b_full;

shared uint s_low;
shared uint s_high;
shared uint s_most;    // of one step
shared uint s_sum[kOrderLocalSize];
shared uint s_next[kDepthSteps];   // where the next of a step goes: in the end, where the step ends

const uint kStepsEach = kDepthSteps / kOrderLocalSize;
// A step of more is not ordered by comparing all with all.
const uint kFew = 64u;

uint step_of(uint depth_bits, float low, float scale) {
  return min(uint((uintBitsToFloat(depth_bits) - low) * scale), kDepthSteps - 1u);
}

// Counts how many there are in each step of depth, and puts where each begins into s_next.
void find_steps(uint begin, uint end, float low, float scale) {
  uint me = gl_LocalInvocationID.x;
  for (uint i = begin + me; i < end; i += kOrderLocalSize)
    atomicAdd(s_next[step_of(texelFetch(u_pairs, int(i)).r, low, scale)], 1u);
  barrier();
  uint sum = 0u;
  for (uint i = 0u; i < kStepsEach; ++i) sum += s_next[me * kStepsEach + i];
  s_sum[me] = sum;
  barrier();
  uint next = begin;
  for (uint i = 0u; i < me; ++i) next += s_sum[i];
  uint most = 0u;
  for (uint i = 0u; i < kStepsEach; ++i) {
    uint count = s_next[me * kStepsEach + i];
    most = max(most, count);
    s_next[me * kStepsEach + i] = next;
    next += count;
  }
  atomicMax(s_most, most);
  barrier();
}

void main() {
  uint tile = gl_WorkGroupID.y * u_frame.grid.x + gl_WorkGroupID.x;
  uint begin = texelFetch(u_first, int(tile)).r;
  uint end = texelFetch(u_first, int(tile + 1u)).r;
  uint me = gl_LocalInvocationID.x;
  if (me == 0u) {
    s_low = 0xffffffffu;
    s_high = 0u;
    s_most = 0u;
  }
  for (uint i = me; i < kDepthSteps; i += kOrderLocalSize) s_next[i] = 0u;
  barrier();
  // Depths in front of the eye are positive: their bits are ordered as they are.
  uint low_bits = 0xffffffffu;
  uint high_bits = 0u;
  for (uint i = begin + me; i < end; i += kOrderLocalSize) {
    uint depth = texelFetch(u_pairs, int(i)).r;
    low_bits = min(low_bits, depth);
    high_bits = max(high_bits, depth);
  }
  atomicMin(s_low, low_bits);
  atomicMax(s_high, high_bits);
  barrier();
  float low = uintBitsToFloat(s_low);
  float scale = float(kDepthSteps) / max(uintBitsToFloat(s_high) - low, 1e-9);
  find_steps(begin, end, low, scale);
  bool is_full = s_most > kFew;
  if (is_full && me == 0u) b_full.tile[atomicAdd(b_totals.total[kTotalFullTiles], 1u)] = tile;
  // Loops that are not entered, because llvmpipe pays for branches that are not taken.
  uint ordered_end = is_full ? begin : end;
  for (uint i = begin + me; i < ordered_end; i += kOrderLocalSize) {
    uvec2 pair = texelFetch(u_pairs, int(i)).rg;
    b_grouped.pair[atomicAdd(s_next[step_of(pair.x, low, scale)], 1u)] = pair;
  }
  memoryBarrierBuffer();
  barrier();
  // Back again, each behind those of its step that are before it.
  for (uint i = begin + me; i < ordered_end; i += kOrderLocalSize) {
    uvec2 pair = b_grouped.pair[i];
    uint of_depth = step_of(pair.x, low, scale);
    uint from = of_depth == 0u ? begin : s_next[of_depth - 1u];
    uint to = s_next[of_depth];
    uint place = from;
    for (uint j = from; j < to; ++j) place += is_before(b_grouped.pair[j], pair) ? 1u : 0u;
    b_pairs.pair[place] = pair;
  }
}

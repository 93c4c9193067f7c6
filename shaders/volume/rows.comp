// Counts of cells to where the records of each begin, to lists of the cells in use, and to what segments of eight
// nodes their hair comes to once it is smoothed. Leaves the counts at zero. An invocation per row of cells.
#pragma variant SORTS 0 1
#include "volume/facts.glsl"

layout(local_size_x = kVolumeLocalSize) in;
layout(std430, binding = kBindingVolumeFacts) restrict buffer FactBlock { uint fact[]; } b_facts;
layout(std430, binding = kBindingVolumeCounts) restrict buffer CountBlock { uint count[]; } b_counts;
layout(std430, binding = kBindingVolumeMasks) writeonly restrict buffer MaskBlock { uvec2 mask[]; } b_masks;
#if SORTS
// First record of a cell, and its number among the cells in use + 1.
layout(std430, binding = kBindingVolumeCells) writeonly restrict buffer CellBlock { uvec2 cell[]; } b_cells;
// First record and records of each cell in use; of those with a crowd, which have none there, in a list of their own
// with the cell's number.
layout(std430, binding = kBindingVolumeLists) writeonly restrict buffer ListBlock { uvec4 entry[]; } b_lists;
#endif

uniform uint u_reach;         // nodes that smoothing goes
uniform uint u_crowds_begin;  // in the lists

void main() {
  const uvec3 nodes = volume_nodes();
  const uint row = volume_invocation();
  if (row >= nodes.y * nodes.z) return;
  const uint begin = row * nodes.x;
  uint placed = 0u, cells = 0u, crowds = 0u, most = 0u;
  uvec2 mask = uvec2(0u);
  for (uint x = 0u; x < nodes.x; ++x) {
    const uint count = b_counts.count[begin + x];
    placed += count;
    most = max(most, count);
    cells += min(count, 1u);
    crowds += count > kVolumeCrowd ? 1u : 0u;
    const uint low = (max(x, u_reach) - u_reach) / kVolumeSegment;
    const uint high = min(x + 1u + u_reach, nodes.x - 1u) / kVolumeSegment;
    const uint segments = count > 0u ? (2u << (high - low)) - 1u : 0u;
    mask.x |= low < 32u ? segments << low : 0u;
    mask.y |= low >= 32u ? segments << (low - 32u) : low > 0u ? segments >> (32u - low) : 0u;
  }
  b_masks.mask[row] = mask;
  uint at = 0u, number = 0u, crowd = 0u;
  if (placed > 0u) {
    at = atomicAdd(b_facts.fact[kFactPlaced], placed);
    atomicMax(b_facts.fact[kFactMostCount], most);
  }
#if SORTS
  if (placed > 0u) number = atomicAdd(b_facts.fact[kFactCells], cells);
  if (crowds > 0u) crowd = u_crowds_begin + atomicAdd(b_facts.fact[kFactCrowds], crowds);
#endif
  for (uint x = 0u; x < nodes.x; ++x) {
    const uint count = b_counts.count[begin + x];
#if SORTS
    b_cells.cell[begin + x] = count > 0u ? uvec2(at, number + 1u) : uvec2(0u);
    if (count > 0u) {
      const bool is_crowd = count > kVolumeCrowd;
      b_lists.entry[number] = uvec4(at, is_crowd ? 0u : count, 0u, 0u);
      if (is_crowd) {
        b_lists.entry[crowd] = uvec4(at, count, number, 0u);
        ++crowd;
      }
      at += count;
      ++number;
    }
#endif
    if (count > 0u) b_counts.count[begin + x] = 0u;
  }
}

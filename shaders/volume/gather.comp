// Sums at nodes: of what the cells around each hold for it, or of integers that were added there. An invocation
// per node of a segment.
#pragma variant FROM_CELLS 0 1
#include "volume/nodes.glsl"

#if FROM_CELLS
layout(binding = kUnitVolumeCell) uniform usamplerBuffer u_cell;
layout(binding = kUnitVolumeSum) uniform samplerBuffer u_sum;
#else
layout(std430, binding = kBindingVolumeRecords) restrict buffer FixedBlock { ivec4 node[]; } b_fixed;

uniform float u_most_length;  // of a sample, m
#endif

#if FROM_CELLS
// What the cell holds for its corner; cells without hair, and behind the last node of a row or layer, hold zeros.
vec4 held_for(int cell, int corner) {
  const uint number = cell >= 0 ? texelFetch(u_cell, max(cell, 0)).y : 0u;
  return texelFetch(u_sum, int(8u * number) + corner);
}
#endif

void main() {
  const uvec3 nodes = volume_nodes();
  const VolumeNode node = volume_node(nodes);
  if (!node.is_there) return;
#if FROM_CELLS
  const int at = int(node.index);
  const int row = int(nodes.x);
  const int layer = int(nodes.x * nodes.y);
  vec4 sum = held_for(at, 0) + held_for(at - 1, 1);
  sum += held_for(at - row, 2) + held_for(at - row - 1, 3);
  sum += held_for(at - layer, 4) + held_for(at - layer - 1, 5);
  sum += held_for(at - layer - row, 6) + held_for(at - layer - row - 1, 7);
#else
  const vec4 scale = fixed_scale(min(8u * fact(kFactMostCount), fact(kFactPlaced)), u_most_length);
  const vec4 sum = vec4(b_fixed.node[node.index]) / scale;
  b_fixed.node[node.index] = ivec4(0);
#endif
  store_node(node.index, sum);
}

// The grid around the hair that was found, with a margin that smoothing fills and one for strands that move on
// while the volume stays; cut down to the groom's own box, side by side, where it would be too large
// (HairVolume::fit_grid). One invocation.
#include "shared/bindings.h"
#include "shared/hair_volume.h"

layout(local_size_x = 1) in;
layout(std430, binding = kBindingVolumeFacts) restrict buffer FactBlock { uint fact[]; } b_facts;
layout(std430, binding = kBindingVolumeNodes) writeonly restrict buffer NodeBlock { vec4 node[]; } b_nodes;

uniform float u_per_cell;  // cells per metre
uniform vec3 u_home_low;   // the groom's own box, in cells
uniform vec3 u_home_high;
uniform uint u_margin;
uniform uint u_most_nodes;

bool is_too_large(uvec3 nodes) {
  if (nodes.x > kVolumeMostAcross) return true;
  // In numbers that the product does not leave.
  const float about = float(nodes.x) * float(nodes.y) * float(nodes.z);
  return about > 1e9 || nodes.x * nodes.y * nodes.z > u_most_nodes;
}

void main() {
  const int margin = int(u_margin);
  const ivec3 home_first = ivec3(u_home_low) - margin;
  const ivec3 home_last = ivec3(u_home_high) + margin;
  ivec3 first = home_first;
  ivec3 last = home_last;
  if (b_facts.fact[kFactLow] <= b_facts.fact[kFactHigh])
    for (uint axis = 0u; axis < 3u; ++axis) {
      first[axis] = int(b_facts.fact[kFactLow + axis]) - int(kVolumeCellBias) - margin;
      last[axis] = int(b_facts.fact[kFactHigh + axis]) - int(kVolumeCellBias) + 1 + margin;
    }
  // The side that sticks out farthest gives way first.
  while (is_too_large(uvec3(last - first + 1))) {
    const bool is_wide = last.x - first.x + 1 > int(kVolumeMostAcross);
    const ivec3 below = home_first - first;
    const ivec3 above = last - home_last;
    int worst = 0;
    for (int axis = 1; axis < 3; ++axis)
      if (!is_wide && max(below[axis], above[axis]) > max(below[worst], above[worst])) worst = axis;
    if (max(below[worst], above[worst]) <= 0) break;  // the groom's own box fits
    if (below[worst] >= above[worst])
      ++first[worst];
    else
      --last[worst];
  }
  const uvec3 nodes = uvec3(last - first + 1);
  for (uint axis = 0u; axis < 3u; ++axis) {
    b_facts.fact[kFactFirst + axis] = uint(first[axis] + int(kVolumeCellBias));
    b_facts.fact[kFactNodes + axis] = nodes[axis];
    b_facts.fact[kFactLow + axis] = 0xffffffffu;
    b_facts.fact[kFactHigh + axis] = 0u;
  }
  b_facts.fact[kFactMomentum] = b_facts.fact[kFactMostMomentum];
  for (uint word = kFactMostMomentum; word <= kFactSegments; ++word) b_facts.fact[word] = 0u;
  const uint groups = (nodes.y * nodes.z + kVolumeLocalSize - 1u) / kVolumeLocalSize;
  b_facts.fact[kFactRowGroups] = min(groups, kVolumeGroupsAcross);
  b_facts.fact[kFactRowGroups + 1u] = (groups + kVolumeGroupsAcross - 1u) / kVolumeGroupsAcross;
  b_facts.fact[kFactRowGroups + 2u] = 1u;
  b_nodes.node[0] = vec4(vec3(first), u_per_cell);
  b_nodes.node[1] = vec4(vec3(nodes), 0.0);
}

// Nodes of a volume from the samples in the bins about them: mean velocity, and length of hair per space. By planes
// that is the bin of the node, and what lies across a plane is missed.
#include "study/bins.glsl"

#if BY_PLANES
layout(std430, binding = kBindingStudyMembers) readonly restrict buffer MemberBlock { uint member[]; } b_members;
#else
layout(std430, binding = kBindingStudySorted) readonly restrict buffer SortedBlock { vec4 value[]; } b_sorted;
#endif
layout(std430, binding = kBindingStudyNodes) writeonly restrict buffer NodeBlock { vec4 value[]; } b_nodes;

uniform float u_per_cell_m3;

vec4 value_for(vec3 node, vec4 place, vec4 motion) {
  const vec3 share = max(1.0 - abs(place.xyz - node), vec3(0.0));
  return share.x * share.y * share.z * place.w * vec4(motion.xyz, 1.0);
}

void main() {
  const uvec3 count = uvec3(u_node_count);
  const uint node = gl_GlobalInvocationID.x;
  if (node >= count.x * count.y * count.z) return;
  const vec3 at = vec3(node % count.x, node / count.x % count.y, node / (count.x * count.y));
  vec4 sum = vec4(0.0);
#if BY_PLANES
  const uint bin = bin_of(at);
  const uint end = min(b_bins.count[bin], u_bin_size);
  for (uint k = 0u; k < end; ++k) {
    const uint i = b_members.member[bin * u_bin_size + k];
    const vec4 place = sample_place(i);
    if (all(lessThan(abs(place.xyz - at), vec3(1.0)))) sum += value_for(at, place, sample_motion(i));
  }
#else
  // Cells next to each other along x are so in the sorted order.
  for (int row = 0; row < 4; ++row) {
    const vec3 cell = at - vec3(1.0, row & 1, row >> 1);
    if (any(lessThan(cell.yz, vec2(0.0)))) continue;
    const uint begin = bin_of(vec3(max(cell.x, 0.0), cell.yz)), end = bin_of(vec3(at.x, cell.yz)) + 1u;
    for (uint i = b_bins.count[begin]; i < b_bins.count[end]; ++i)
      sum += value_for(at, b_sorted.value[2u * i], b_sorted.value[2u * i + 1u]);
  }
#endif
  b_nodes.value[node] = vec4(sum.w > 0.0 ? sum.xyz / sum.w : vec3(0.0), sum.w * u_per_cell_m3);
}

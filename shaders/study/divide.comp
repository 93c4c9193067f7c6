// Nodes of a volume from the sums that were drawn: mean velocity, and length of hair per space.
#include "shared/limits.h"
#include "shared/scatter_study.h"

layout(local_size_x = kStrandLocalSize) in;
layout(binding = kUnitStudySum) uniform sampler3D u_sum;
layout(std430, binding = kBindingStudyNodes) writeonly restrict buffer NodeBlock { vec4 value[]; } b_nodes;

uniform vec3 u_node_count;
uniform float u_per_cell_m3;

void main() {
  const uvec3 count = uvec3(u_node_count);
  const uint node = gl_GlobalInvocationID.x;
  if (node >= count.x * count.y * count.z) return;
  const ivec3 at = ivec3(node % count.x, node / count.x % count.y, node / (count.x * count.y));
  const vec4 sum = texelFetch(u_sum, at, 0);
  b_nodes.value[node] = vec4(sum.w > 0.0 ? sum.xyz / sum.w : vec3(0.0), sum.w * u_per_cell_m3);
}

// What kernels over the segments of nodes share: eight invocations each, which node each has, and how sums become
// mean velocity and density.
#pragma variant DIVIDES 0 1
#include "volume/facts.glsl"

layout(local_size_x = kVolumeLocalSize) in;
layout(std430, binding = kBindingVolumeNodes) writeonly restrict buffer NodeBlock { vec4 node[]; } b_nodes;
layout(binding = kUnitVolumeSegment) uniform usamplerBuffer u_segment;

uniform float u_per_cell_m3;

struct VolumeNode {
  uint index;
  uvec3 at;
  bool is_there;
};

VolumeNode volume_node(uvec3 nodes) {
  const uint invocation = volume_invocation();
  const bool is_listed = invocation / kVolumeSegment < fact(kFactSegments);
  const uvec4 segment = texelFetch(u_segment, is_listed ? int(invocation / kVolumeSegment) : 0);
  const uint along = invocation % kVolumeSegment;
  return VolumeNode(segment.x + along, segment.yzw + uvec3(along, 0u, 0u), is_listed && segment.y + along < nodes.x);
}

// Momentum and length; with DIVIDES as mean velocity and density.
void store_node(uint index, vec4 sum) {
#if DIVIDES
  const float inverse = sum.w > 1e-20 ? 1.0 / sum.w : 0.0;
  sum = vec4(inverse * sum.xyz, u_per_cell_m3 * sum.w);
#endif
  b_nodes.node[kVolumeHeader + index] = sum;
}

// Samples straight into the nodes around them, by 32 integer atomic additions each. A row of invocations for each
// row of samples, an invocation for each strand.
#include "volume/corners.glsl"
#include "volume/grid.glsl"
#include "volume/samples.glsl"

layout(local_size_x = kVolumeLocalSize) in;
layout(std430, binding = kBindingVolumeNodes) restrict buffer FixedBlock { int part[]; } b_fixed;

uniform float u_most_length;  // of a sample, m

void add_to_node(uint node, ivec4 sum) {
  atomicAdd(b_fixed.part[4u * node], sum.x);
  atomicAdd(b_fixed.part[4u * node + 1u], sum.y);
  atomicAdd(b_fixed.part[4u * node + 2u], sum.z);
  atomicAdd(b_fixed.part[4u * node + 3u], sum.w);
}

void main() {
  const uint strand = gl_GlobalInvocationID.x;
  if (strand >= u_strand_count) return;
  const SampleIndex which = sample_index(strand, gl_GlobalInvocationID.y);
  const vec4 place = sample_place(which);
  const uvec3 nodes = volume_nodes();
  const ivec3 cell = cell_of(place.xyz);
  if (!is_sample(place.xyz, place.w) || !is_in_grid(cell, nodes)) return;
  // No node has more samples around it.
  const vec4 scale = fixed_scale(min(8u * fact(kFactMostCount), fact(kFactPlaced)), u_most_length);
  const vec4 value = scale * (place.w * vec4(sample_velocity(which), 1.0));
  ivec4 s0 = ivec4(0), s1 = s0, s2 = s0, s3 = s0, s4 = s0, s5 = s0, s6 = s0, s7 = s0;
  ADD_TO_CORNERS(place.xyz - floor(place.xyz), value, sample_dither(which))
  const uint at = index_of(cell, nodes);
  const uint layer = nodes.x * nodes.y;
  add_to_node(at, s0);
  add_to_node(at + 1u, s1);
  add_to_node(at + nodes.x, s2);
  add_to_node(at + nodes.x + 1u, s3);
  add_to_node(at + layer, s4);
  add_to_node(at + layer + 1u, s5);
  add_to_node(at + layer + nodes.x, s6);
  add_to_node(at + layer + nodes.x + 1u, s7);
}

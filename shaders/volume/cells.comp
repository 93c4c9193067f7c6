// Sums of the samples of each cell in use for the eight nodes around it. An invocation per cell; of a cell with a
// crowd a group of them.
#pragma variant HAS_CROWD 0 1
#include "volume/corners.glsl"
#include "volume/facts.glsl"
#include "volume/samples.glsl"

layout(local_size_x = kVolumeLocalSize) in;
// (cells in use + 1) x 8 corners, the first of them zero.
layout(std430, binding = kBindingVolumeNodes) writeonly restrict buffer SumBlock { vec4 sum[]; } b_sums;
layout(binding = kUnitVolumeRecord) uniform usamplerBuffer u_record;
layout(binding = kUnitVolumeList) uniform usamplerBuffer u_list;

uniform float u_most_length;  // of a sample, m
uniform uint u_crowds_begin;  // in the lists

#if HAS_CROWD
shared int s_sum[32];

void add_to_shared(uint corner, ivec4 sum) {
  for (uint i = 0u; i < 4u; ++i) atomicAdd(s_sum[4u * corner + i], sum[i]);
}
#endif

void main() {
#if HAS_CROWD
  // Groups are one for each crowd, and some at the end of a row of groups for none.
  const uint crowd = gl_WorkGroupID.y * kVolumeGroupsAcross + gl_WorkGroupID.x;
  const bool is_there = crowd < fact(kFactCrowds);
  const uvec4 entry = is_there ? texelFetch(u_list, int(u_crowds_begin + crowd)) : uvec4(0u);
  const uint number = entry.z;
  const uint first = gl_LocalInvocationID.x;
  const uint stride = kVolumeLocalSize;
  if (gl_LocalInvocationID.x < 32u) s_sum[gl_LocalInvocationID.x] = 0;
  barrier();
#else
  const uint number = volume_invocation();
  if (number >= fact(kFactCells)) return;
  const uvec4 entry = texelFetch(u_list, int(number));
  const uint first = 0u;
  const uint stride = 1u;
#endif
  const vec4 scale = fixed_scale(entry.y, u_most_length);
  ivec4 s0 = ivec4(0), s1 = s0, s2 = s0, s3 = s0, s4 = s0, s5 = s0, s6 = s0, s7 = s0;
  for (uint i = first; i < entry.y; i += stride) {
    const SampleIndex which = unpacked_index(texelFetch(u_record, int(entry.x + i)).x);
    const vec4 place = sample_place(which);
    const vec4 value = scale * (place.w * vec4(sample_velocity(which), 1.0));
    ADD_TO_CORNERS(place.xyz - floor(place.xyz), value, sample_dither(which))
  }
  const vec4 back = 1.0 / scale;
  const uint to = (number + 1u) * 8u;
#if HAS_CROWD
  add_to_shared(0u, s0);
  add_to_shared(1u, s1);
  add_to_shared(2u, s2);
  add_to_shared(3u, s3);
  add_to_shared(4u, s4);
  add_to_shared(5u, s5);
  add_to_shared(6u, s6);
  add_to_shared(7u, s7);
  barrier();
  const uint corner = gl_LocalInvocationID.x;
  if (is_there && corner < 8u)
    b_sums.sum[to + corner] = back * vec4(s_sum[4u * corner], s_sum[4u * corner + 1u], s_sum[4u * corner + 2u],
                                          s_sum[4u * corner + 3u]);
#else
  b_sums.sum[to] = back * vec4(s0);
  b_sums.sum[to + 1u] = back * vec4(s1);
  b_sums.sum[to + 2u] = back * vec4(s2);
  b_sums.sum[to + 3u] = back * vec4(s3);
  b_sums.sum[to + 4u] = back * vec4(s4);
  b_sums.sum[to + 5u] = back * vec4(s5);
  b_sums.sum[to + 6u] = back * vec4(s6);
  b_sums.sum[to + 7u] = back * vec4(s7);
#endif
}

// Samples copied in the order of their bins.
#include "study/bins.glsl"

layout(std430, binding = kBindingStudyMembers) readonly restrict buffer RankBlock { uint rank[]; } b_ranks;
layout(std430, binding = kBindingStudySorted) writeonly restrict buffer SortedBlock { vec4 value[]; } b_sorted;

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= u_sample_count) return;
  const vec4 place = sample_place(i);
  const uint to = b_bins.count[bin_of(place.xyz)] + b_ranks.rank[i];
  b_sorted.value[2u * to] = place;
  b_sorted.value[2u * to + 1u] = sample_motion(i);
}

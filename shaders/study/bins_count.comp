// How many samples each bin has, and which of them each is.
#include "study/bins.glsl"

layout(std430, binding = kBindingStudyMembers) writeonly restrict buffer MemberBlock { uint member[]; } b_members;

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= u_sample_count) return;
  const uint bin = bin_of(sample_place(i).xyz);
  const uint rank = atomicAdd(b_bins.count[bin], 1u);
#if BY_PLANES
  if (rank < u_bin_size) b_members.member[bin * u_bin_size + rank] = i;
#else
  b_members.member[i] = rank;
#endif
}

// How many samples there are in each cell, and which of them each is. An invocation per sample.
#pragma variant KEEPS_RANKS 0 1
#include "volume/samples.glsl"

layout(local_size_x = kVolumeLocalSize) in;
layout(std430, binding = kBindingVolumeCounts) restrict buffer CountBlock { uint count[]; } b_counts;
#if KEEPS_RANKS
layout(std430, binding = kBindingVolumeRanks) writeonly restrict buffer RankBlock { uint rank[]; } b_ranks;
#endif

void main() {
  const uint strand = gl_GlobalInvocationID.x;
  const uint row = gl_GlobalInvocationID.y;
  if (strand >= u_step.shape.x) return;
  const HairSample found = hair_sample(strand, row);
  const uvec3 nodes = volume_nodes();
  const ivec3 cell = cell_of(found);
  uint rank = 0xffffffffu;  // outside
  if (found.is_there && is_in_grid(cell, nodes)) rank = atomicAdd(b_counts.count[index_of(cell, nodes)], 1u);
#if KEEPS_RANKS
  b_ranks.rank[row * u_step.shape.x + strand] = rank;
#endif
}

// In which cell each sample is, and which of its samples. A row of invocations for each row of samples, an
// invocation for each strand.
#pragma variant KEEPS_RANKS 0 1
#include "volume/grid.glsl"
#include "volume/samples.glsl"

layout(local_size_x = kVolumeLocalSize) in;
layout(std430, binding = kBindingVolumeCounts) restrict buffer CountBlock { uint count[]; } b_counts;
#if KEEPS_RANKS
// (rows of samples x strand_count) cell and rank.
layout(std430, binding = kBindingVolumeRanks) writeonly restrict buffer RankBlock { uvec2 rank[]; } b_ranks;
#endif

void main() {
  const uint strand = gl_GlobalInvocationID.x;
  const uint row = gl_GlobalInvocationID.y;
  if (strand >= u_strand_count) return;
  const vec4 place = sample_place(sample_index(strand, row));
  const uvec3 nodes = volume_nodes();
  const ivec3 cell = cell_of(place.xyz);
  uvec2 rank = uvec2(0u, kVolumeOutside);
  if (is_sample(place.xyz, place.w) && is_in_grid(cell, nodes)) {
    rank.x = index_of(cell, nodes);
    rank.y = atomicAdd(b_counts.count[rank.x], 1u);
  }
#if KEEPS_RANKS
  b_ranks.rank[row * u_strand_count + strand] = rank;
#endif
}

// Samples sorted by cells: which they are. A row of invocations for each row of samples, an invocation for each
// strand.
#include "volume/samples.glsl"

layout(local_size_x = kVolumeLocalSize) in;
layout(std430, binding = kBindingVolumeRecords) writeonly restrict buffer RecordBlock { uint record[]; } b_records;
layout(binding = kUnitVolumeRank) uniform usamplerBuffer u_rank;
layout(binding = kUnitVolumeCell) uniform usamplerBuffer u_cell;

void main() {
  const uint strand = gl_GlobalInvocationID.x;
  const uint row = gl_GlobalInvocationID.y;
  if (strand >= u_strand_count) return;
  const uvec2 rank = texelFetch(u_rank, int(row * u_strand_count + strand)).xy;
  if (rank.y == kVolumeOutside) return;
  b_records.record[texelFetch(u_cell, int(rank.x)).x + rank.y] = packed_index(sample_index(strand, row));
}

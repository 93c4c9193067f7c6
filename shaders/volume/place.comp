// Samples sorted by cells: where in its cell each lies with its length, and its momentum. An invocation per sample.
#include "volume/samples.glsl"

layout(local_size_x = kVolumeLocalSize) in;
layout(std430, binding = kBindingVolumeRecords) writeonly restrict buffer RecordBlock { vec4 record[]; } b_records;
layout(binding = kUnitVolumeRank) uniform usamplerBuffer u_rank;
layout(binding = kUnitVolumeCell) uniform usamplerBuffer u_cell;

void main() {
  const uint strand = gl_GlobalInvocationID.x;
  const uint row = gl_GlobalInvocationID.y;
  if (strand >= u_step.shape.x) return;
  const uint rank = texelFetch(u_rank, int(row * u_step.shape.x + strand)).x;
  if (rank == 0xffffffffu) return;
  const HairSample found = hair_sample(strand, row);
  const uint at = texelFetch(u_cell, int(index_of(cell_of(found), volume_nodes()))).x + rank;
  b_records.record[2u * at] = vec4(found.cells - floor(found.cells), found.weight);
  b_records.record[2u * at + 1u] = vec4(found.weight * found.velocity, 0.0);
}

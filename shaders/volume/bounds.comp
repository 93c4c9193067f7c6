// Which cells of the lattice there is hair in, from and to along each axis, and the largest momentum of a sample. Each
// invocation looks at several strands.
#include "volume/samples.glsl"

layout(local_size_x = kVolumeLocalSize) in;
layout(std430, binding = kBindingVolumeFacts) restrict buffer FactBlock { uint fact[]; } b_facts;

void main() {
  uvec3 low = uvec3(0xffffffffu);
  uvec3 high = uvec3(0u);
  float most = 0.0;
  const uint stride = gl_NumWorkGroups.x * kVolumeLocalSize;
  for (uint strand = gl_GlobalInvocationID.x; strand < u_step.shape.x; strand += stride)
    for (uint row = 0u; row < u_row_count; ++row) {
      const HairSample found = hair_sample(strand, row);
      const uvec3 cell = uvec3(ivec3(select(found.is_there, floor(found.cells), vec3(0.0))) + int(kVolumeCellBias));
      low = select(found.is_there, min(low, cell), low);
      high = select(found.is_there, max(high, cell), high);
      const vec3 momentum = abs(found.weight * found.velocity);
      most = select(found.is_there, max(most, max(max(momentum.x, momentum.y), momentum.z)), most);
    }
  for (uint axis = 0u; axis < 3u; ++axis) {
    atomicMin(b_facts.fact[kFactLow + axis], low[axis]);
    atomicMax(b_facts.fact[kFactHigh + axis], high[axis]);
  }
  // Numbers that are not negative are ordered as their bits are.
  atomicMax(b_facts.fact[kFactMostMomentum], floatBitsToUint(most));
}

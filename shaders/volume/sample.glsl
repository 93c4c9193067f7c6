// Samples of strands: what is one, and where those of a segment lie.
#include "shared/hair_volume.h"

// Hair at a number, within reach. By bits: compilers may turn comparisons around, which changes what they say about NaN.
bool is_sample(vec3 cells, float weight) {
  const uvec3 magnitude = floatBitsToUint(cells) & 0x7fffffffu;
  return weight > 0.0 && max(max(magnitude.x, magnitude.y), magnitude.z) < floatBitsToUint(float(kVolumeReach));
}

float sample_share(uint index, uint count) { return (float(index) + 0.5) / float(count); }

// Kernels must agree on the cell to the bit: nothing of it may be fused.
vec3 between(vec3 before, vec3 after, float share) {
  precise vec3 result = before + (after - before) * share;
  return result;
}

// The facts of a hair volume under way, as the kernels that make it read them: the grid and how much of it is in use.
#include "shared/bindings.h"
#include "shared/hair_volume.h"

layout(std140, binding = kBindingVolumeFactsRead) uniform VolumeFacts {
  uvec4 word[kFactCount / 4u];
} u_facts;

uint fact(uint index) { return u_facts.word[index / 4u][index % 4u]; }
ivec3 volume_first() {
  return ivec3(uvec3(fact(kFactFirst), fact(kFactFirst + 1u), fact(kFactFirst + 2u))) - int(kVolumeCellBias);
}
uvec3 volume_nodes() { return uvec3(fact(kFactNodes), fact(kFactNodes + 1u), fact(kFactNodes + 2u)); }

// Of an indirect dispatch: groups lie in rows.
uint volume_invocation() {
  return (gl_WorkGroupID.y * kVolumeGroupsAcross + gl_WorkGroupID.x) * kVolumeLocalSize + gl_LocalInvocationID.x;
}

float power_of_two(int exponent) { return uintBitsToFloat(uint(clamp(exponent, -126, 127) + 127) << 23); }
// The least n with count <= 2^n.
int bits_of(uint count) { return count > 1u ? findMSB(count - 1u) + 1 : 0; }
// By which (momentum, length) become integers, so many of which sum to less than 2^31 however they come: a power of
// two, which takes nothing away. Lengths are below 2^length_exponent.
vec4 fixed_scale(uint count, int length_exponent) {
  const int bits = 30 - bits_of(count);
  const int momentum_exponent = int(fact(kFactMomentumExponent)) - int(kVolumeCellBias);
  return vec4(vec3(power_of_two(bits - momentum_exponent)), power_of_two(bits - length_exponent));
}

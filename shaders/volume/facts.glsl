// The facts of a hair volume under way, as the kernels that make it read them: the grid and how much of it is in
// use.
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

// By which (momentum, length) become integers, so many of which stay below 2^31 however they come and are rounded.
vec4 fixed_scale(uint count, float most_length) {
  const float room = 0.999999 * (2147483648.0 - 2.0 * float(count)) / float(max(count, 1u));
  const vec4 most = vec4(vec3(uintBitsToFloat(fact(kFactMomentum))), most_length);
  return room / max(most, vec4(1e-20));
}

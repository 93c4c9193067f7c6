// What strands of one kind had, put back: of a groom in which some tips are pinned, a kernel's run counts for the
// strands of its own kind alone (server/sim/mixed_tips.h). HAS_PINNED_TAIL says which kind gets back what it had; any
// plane is bound as the position, its copy as the place before. The same kernel makes the copy. One invocation per
// strand.
#pragma variant HAS_PINNED_TAIL 0 1
#include "sim/step.glsl"

layout(local_size_x = kStrandLocalSize) in;

layout(binding = kUnitRodStrand) uniform samplerBuffer u_strand;    // x = 1: its tip is pinned
layout(binding = kUnitPlaceBefore) uniform samplerBuffer u_before;  // what it had

void main() {
  const uint stride = u_step.shape.x;
  const uint strand = gl_GlobalInvocationID.x;
  if (strand >= stride) return;
  const float tip = texelFetch(u_strand, int(strand)).x;
#if HAS_PINNED_TAIL
  const lane_bool is_one = tip > 0.5;
#else
  const lane_bool is_one = tip < 0.5;
#endif
  if (!is_any(is_one)) return;
  uint at = strand;
  for (uint i = 0u; i < u_step.shape.y; ++i) {
    const vec4 before = texelFetch(u_before, int(at));
    const vec4 now = texelFetch(u_position, int(at));
    b_position.position[at] = vec4(select(is_one, before.xyz, now.xyz), select(is_one, before.w, now.w));
    at += stride;
  }
}

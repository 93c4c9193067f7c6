// Drag of thin cylinders, before a substep of whatever model: air drags a hair less along its length than across. A
// model's own drag is alike in all directions, so what of it goes along the hair is given back in advance, but for a
// share (slender bodies at low Reynolds numbers: a half). The model then takes all of its drag implicitly, or the step
// is short against it, so that no motion grows: of one along (1 + h c (1 - share)) / (1 + h c) is left. One invocation
// per strand.
#pragma variant HAS_WAY 0 1
#include "sim/gust.glsl"

layout(local_size_x = kStrandLocalSize) in;

#if HAS_WAY
// Way of every vertex in the last substep, world, m: velocities of such models answer to more than motion.
layout(binding = kUnitDisplacement) uniform samplerBuffer u_displacement;
#endif

uniform float u_given_back;  // 1 - share

void main() {
  const uint stride = u_step.shape.x;
  const uint strand = gl_GlobalInvocationID.x;
  if (strand >= stride) return;
  const uint end = u_step.shape.w;
  if (u_step.shape.z >= end) return;
  const float drag = u_step.head_velocity.w * u_step.contact.y * u_given_back;
  uint at = u_step.shape.z * stride + strand;
  vec3 before = texelFetch(u_position, int(at - stride)).xyz;
  vec3 here = texelFetch(u_position, int(at)).xyz;
  for (uint i = u_step.shape.z; i < end; ++i) {
    const uint after_at = i + 1u < u_step.shape.y ? at + stride : at;
    const vec3 after = texelFetch(u_position, int(after_at)).xyz;
    const vec4 stored = texelFetch(u_velocity, int(at));
#if HAS_WAY
    const vec3 moving = texelFetch(u_displacement, int(at)).xyz * u_step.push.w - u_step.head_velocity.xyz;
#else
    const vec3 moving = stored.xyz - u_step.head_velocity.xyz;
#endif
    const vec3 along = after - before;
    const vec3 wind = u_step.wind.xyz + gust_velocity(here) - moving;
    const vec3 given_back = along * (drag * dot(wind, along) / max(dot(along, along), kTinySquared));
    const lane_bool is_lost = is_broken(stored.xyz) || is_broken(given_back);
    b_velocity.velocity[at] = vec4(select(is_lost, stored.xyz, stored.xyz - given_back), stored.w);
    before = here;
    here = after;
    at += stride;
  }
}

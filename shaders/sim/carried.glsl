// What of a model goes along when a pass moves strands after a substep. MEMORY: 0 = nothing, 1 = the way of every
// vertex in the last substep, 2 = that and the material axis of every segment.
#pragma variant MEMORY 0 1 2
#include "sim/step.glsl"

#if MEMORY >= 1
layout(binding = kUnitDisplacement) uniform samplerBuffer u_way;  // world, m
layout(std430, binding = kBindingDisplacement) writeonly restrict buffer WayBlock {
  vec4 value[];
} b_way;
#endif
#if MEMORY == 2
layout(binding = kUnitRodAxis) uniform samplerBuffer u_axis;  // world
layout(std430, binding = kBindingRodAxis) writeonly restrict buffer AxisBlock { vec4 value[]; } b_axis;
#endif

const float kFoldedBack = 1e-6;

// Across an axis; of any length.
vec3 any_side(vec3 axis) {
  return select(abs(axis.x) < 0.6, vec3(0.0, axis.z, -axis.y), vec3(-axis.z, 0.0, axis.x));
}

#if MEMORY == 2
void turn_axis(lane_bool is_held, uint at, vec3 from, vec3 to) {
  const float squared = min(dot(from, from), dot(to, to));
  const lane_bool is_turned = is_held && squared > kTinySquared;
  if (!is_any(is_turned)) return;
  from = normalize(from);
  to = normalize(to);
  const vec4 axis = texelFetch(u_axis, int(at));
  const float sum = max(1.0 + dot(from, to), kFoldedBack);
  vec3 turned = axis.xyz - (dot(axis.xyz, to) / sum) * (from + to);
  turned -= to * dot(turned, to);
  b_axis.value[at] = vec4(select(is_turned, normalize(turned), axis.xyz), axis.w);
}
#endif

void move_vertex(uint at, vec4 position, vec3 way) {
  b_position.position[at] = vec4(position.xyz + way, position.w);
#if MEMORY >= 1
  const vec4 before = texelFetch(u_way, int(at));
  b_way.value[at] = vec4(before.xyz + way, before.w);
#endif
}

// Pushes single vertices out of colliders, along the normal, with friction. For models that move vertices
// rather than turn segments.
#include "sim/follow.glsl"

// Position before the substep as predict() sees it.
vec3 position_before(uint at) {
  const vec3 stored = texelFetch(u_position, int(at)).xyz;
  const vec3 velocity = texelFetch(u_velocity, int(at)).xyz;
  const lane_bool is_sane = !is_broken(stored) && !is_broken(velocity);
  return select(is_sane, stored, turned_with_head(texelFetch(u_rest, int(at)).xyz));
}

// `at`: the vertex's element in the state.
vec3 outside_colliders(vec3 point, uint at) {
#if COLLIDERS >= 1
  for (int round = 0; round < PUSH_ROUNDS; ++round) {
    const vec4 deepest = deepest_collider(point);
    if (!is_any(deepest.w > 0.0)) break;
    const vec3 held = held_by_friction(position_before(at), point, deepest) - deepest.xyz;
    const float squared = dot(held, held);
    // No way out of the very centre is shorter than another.
    const vec3 out_there = deepest.xyz + held * (deepest.w * inversesqrt(squared));
    point = select(deepest.w > 0.0 && squared > kTinySquared, out_there, point);
  }
#endif
  return point;
}

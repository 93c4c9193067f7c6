// Follicles hold roots: after a substep of any model, the first free segment of a strand is turned back into
// the cone about its groomed direction, and what hangs on it goes along, so that no segment but the first
// changes its direction and none its length. The segment's end loses the velocity that drives it out of the
// cone, seen from the follicle; the vertices beyond are told by the strand's own tensions in the next
// substep. (Velocities that went along with the shift would make the strand weightless where the cone carries
// it: rods then swing for ever.) Nothing gains speed. One invocation per strand; strands inside the cone are
// read only.
#include "sim/carried.glsl"
#include "sim/collider.glsl"

layout(local_size_x = kStrandLocalSize) in;

// Cosine and sine of the angle from `axis` towards `side` at which a segment may stand: the limit, or less
// where a collider is in the way that the groomed direction itself is outside of. In the plane of both, a
// collider takes an arc of directions; the end of the arc next to the axis is where the law of cosines puts
// the segment's end on the sphere.
vec2 held_angle(vec3 start, vec3 axis, vec3 side, float segment) {
  vec2 angle = vec2(u_step.follicle_cosine, u_step.follicle_sine);
#if COLLIDERS >= 1
  for (uint i = 0u; i < COLLIDER_COUNT; ++i) {
    const vec4 sphere = u_step.collider[i];
    const vec3 away = start - sphere.xyz;
    const vec2 part = vec2(dot(away, axis), dot(away, side));
    // The end is outside where dot(direction, part) is at least this.
    const float least = (sphere.w * sphere.w - dot(away, away) - segment * segment) / (2.0 * segment);
    const lane_bool is_in_the_way =
        sphere.w > 0.0 && !(part.x < least) && !(dot(angle, part) >= least);
    if (!is_any(is_in_the_way)) continue;
    const float reach = max(dot(part, part), kTinySquared);
    const float along = clamp(least * inversesqrt(reach), -1.0, 1.0);
    const vec2 turned = vec2(along, sqrt(1.0 - along * along));
    const vec2 held = vec2(part.x * turned.x - part.y * turned.y, part.y * turned.x + part.x * turned.y) *
                      inversesqrt(reach);
    angle = select(is_in_the_way, held, angle);
  }
#endif
  return angle;
}

// `next` out of the colliders, at its distance from the vertex before it.
vec3 outside(vec3 start, vec3 next) {
#if COLLIDERS >= 1
  for (int round = 0; round < PUSH_ROUNDS; ++round) {
    const vec4 deepest = deepest_collider(next);
    const lane_bool is_inside = deepest.w > 0.0;
    if (!is_any(is_inside)) break;
    const vec3 edge = next - start;
    const float segment = sqrt(max(dot(edge, edge), kTinySquared));
    next = select(is_inside, turned_onto_sphere(start, edge / segment, segment, deepest.xyz, deepest.w), next);
  }
#endif
  return next;
}

// Takes from the velocity of a vertex what runs against its way, seen from the follicle's cone, which turns
// with the head.
void take_velocity(uint at, vec3 position, vec3 way) {
  const vec3 carried_back = vec3(dot(u_step.carry[0].xyz, position), dot(u_step.carry[1].xyz, position),
                                 dot(u_step.carry[2].xyz, position));
  const vec3 cone_velocity = u_step.head_velocity.xyz + (position - carried_back) * u_step.push.w;
  const vec4 velocity = texelFetch(u_velocity, int(at));
  const vec3 along = way * inversesqrt(max(dot(way, way), kTinySquared));
  const float outward = max(-dot(velocity.xyz - cone_velocity, along), 0.0);
  b_velocity.velocity[at] = vec4(velocity.xyz + outward * along, velocity.w);
}

void main() {
  const uint stride = u_step.shape.x;
  const uint strand = gl_GlobalInvocationID.x;
  if (strand >= stride) return;
  uint at = u_step.shape.z * stride + strand;
  const vec3 start = texelFetch(u_position, int(at - stride)).xyz;
  vec4 position = texelFetch(u_position, int(at));
  const vec3 edge = position.xyz - start;
  const vec3 groomed =
      turned_with_head(texelFetch(u_rest, int(at)).xyz - texelFetch(u_rest, int(at - stride)).xyz);
  const float squared = dot(edge, edge);
  const float groomed_squared = dot(groomed, groomed);
  // No length has no direction, and what is no number is not this pass's to mend.
  const lane_bool is_held = dot(edge, groomed) < u_step.follicle_cosine * sqrt(squared * groomed_squared) &&
                            min(squared, groomed_squared) > kTinySquared && !is_broken(edge);
  if (!is_any(is_held)) return;

  const vec3 axis = groomed * inversesqrt(groomed_squared);
  vec3 side = edge - axis * dot(edge, axis);
  side = select(dot(side, side) > 1e-12 * squared, normalize(side), any_side(axis));
  side = normalize(side - axis * dot(side, axis));  // a short side is made of roundings
  const float segment = sqrt(squared);
  const vec2 angle = held_angle(start, axis, side, segment);
  const vec3 held = start + segment * (angle.x * axis + angle.y * side);
  vec3 shift = select(is_held, held - position.xyz, vec3(0.0));

  take_velocity(at, position.xyz, shift);
#if MEMORY == 2
  turn_axis(is_held, at, edge, edge + shift);
#endif
  vec3 before = position.xyz;
  vec3 now = before + shift;
  move_vertex(at, position, shift);
  for (uint i = u_step.shape.z + 1u; i < u_step.shape.y; ++i) {
    at += stride;
    position = texelFetch(u_position, int(at));
    const vec3 next = position.xyz + shift;
    const vec3 end = select(is_held, outside(now, next), next);
    // Without contact nothing turns, not by a rounding either.
    const lane_bool is_moved = end != next;
    if (is_any(is_moved)) {
      shift = select(is_moved, end - position.xyz, shift);
#if MEMORY == 2
      turn_axis(is_moved, at, position.xyz - before, end - now);
#endif
    }
    move_vertex(at, position, shift);
    before = position.xyz;
    now = end;
  }
}

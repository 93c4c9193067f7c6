// Limits of bending: after a substep of any model, the angle from each segment to the next is brought between
// a least and a most one, which go from those at the root to those at the tip (Woodhouse 2017, 6.1). A
// segment is turned about its start, in the plane of both; what hangs on it goes along, so that no length and
// no direction beyond changes. What a vertex is moved by counts in its velocity, as with all limits of
// positions: joints that only lose what drives them out never rest, since each carries the ones beyond. How far
// the groom bends is always allowed. One invocation per strand; strands within the limits are read only.
#include "sim/carried.glsl"

layout(local_size_x = kStrandLocalSize) in;

uniform float u_least_root;  // rad
uniform float u_least_tip;
uniform float u_most_root;
uniform float u_most_tip;

// Beyond the groom's own angle, as a cosine: roundings are no bend.
const float kSlack = 1e-5;

float cosine_between(vec3 a, vec3 b) {
  return dot(a, b) * inversesqrt(max(dot(a, a) * dot(b, b), kTinySquared * kTinySquared));
}

void main() {
  const uint stride = u_step.shape.x;
  const uint strand = gl_GlobalInvocationID.x;
  if (strand >= stride) return;
  const uint begin = max(u_step.shape.z, 2u);  // there is a segment before the one that ends here
  if (begin >= u_step.shape.y) return;
  uint at = (begin - 1u) * stride + strand;
  vec3 before = texelFetch(u_position, int(at)).xyz;  // where the model has the segment's start
  vec3 now = before;                                  // where it is
  vec3 edge_before = before - texelFetch(u_position, int(at - stride)).xyz;
  vec3 rest = texelFetch(u_rest, int(at)).xyz;
  vec3 rest_edge_before = rest - texelFetch(u_rest, int(at - stride)).xyz;
  vec3 shift = vec3(0.0);
  for (uint i = begin; i < u_step.shape.y; ++i) {
    at += stride;
    const vec4 position = texelFetch(u_position, int(at));
    const vec4 velocity = texelFetch(u_velocity, int(at));
    const vec3 rest_end = texelFetch(u_rest, int(at)).xyz;
    const vec3 rest_edge = rest_end - rest;
    const vec3 edge = position.xyz - before;
    const float of_groom = cosine_between(rest_edge_before, rest_edge);
    const float most = mix(u_most_root, u_most_tip, position.w);
    const float least = mix(u_least_root, u_least_tip, position.w);
    // Cosines fall as angles grow.
    const float lowest = min(cos(most), of_groom - kSlack);
    const float highest = cos(least) + kSlack;
    const float cosine = cosine_between(edge_before, edge);
    const float squared = dot(edge, edge);
    const float squared_before = dot(edge_before, edge_before);
    // No length has no direction, and what is no number is not this pass's to mend.
    const lane_bool is_turned = (cosine < lowest || cosine > highest) &&
                                min(squared, squared_before) > kTinySquared && !is_broken(edge) &&
                                !is_broken(edge_before);
    vec3 end = position.xyz + shift;
    vec3 lasting = edge;
    if (is_any(is_turned)) {
      const vec3 axis = edge_before * inversesqrt(max(squared_before, kTinySquared));
      vec3 side = edge - axis * dot(edge, axis);
      side = select(dot(side, side) > 1e-12 * squared, side, any_side(axis));
      side -= axis * dot(side, axis);  // a short side is made of roundings
      side *= inversesqrt(max(dot(side, side), kTinySquared));
      const float held = clamp(cosine, max(lowest, -1.0), min(highest, 1.0));
      const vec3 turned = sqrt(squared) * (held * axis + sqrt(max(1.0 - held * held, 0.0)) * side);
      lasting = select(is_turned, turned, edge);
      end = select(is_turned, now + turned, end);
#if MEMORY == 2
      turn_axis(is_turned, at, edge, lasting);
#endif
    }
    shift = end - position.xyz;
    if (is_any(dot(shift, shift) > 0.0)) {
      move_vertex(at, position, shift);
      b_velocity.velocity[at] = vec4(velocity.xyz + u_step.push.w * shift, velocity.w);
    }
    before = position.xyz;
    now = end;
    edge_before = lasting;
    rest = rest_end;
    rest_edge_before = rest_edge;
  }
}

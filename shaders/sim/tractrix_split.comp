// Zappe 2020, 3.0.2: only the last free vertex has forces and drags the strand, which is then pulled back to
// its root; what is shown has every segment turned from there towards the groomed one. One invocation per
// strand.
#include "sim/tractrix_drag.glsl"

layout(local_size_x = kStrandLocalSize) in;

// The dragged strand less the one that is shown, which is the state. The leader's velocity is the dragged
// one's.
layout(binding = kUnitDisplacement) uniform samplerBuffer u_offset;  // world, m
layout(std430, binding = kBindingDisplacement) writeonly restrict buffer OffsetBlock {
  vec4 value[];
} b_offset;

uniform float u_style_mix;     // share of the turn towards the groomed segment
uniform float u_style_return;  // rate of the dragged strand's, 1/s

// Below this the sine of the angle between two directions does not say in which plane to turn.
const float kNoPlaneSquared = 1e-12;

struct Before {
  vec3 shown;
  vec3 dragged;
  vec3 velocity;
};

Before state_before(uint at) {
  const vec3 stored = texelFetch(u_position, int(at)).xyz;
  const vec3 velocity = texelFetch(u_velocity, int(at)).xyz;
  const vec3 offset = texelFetch(u_offset, int(at)).xyz;
  const vec3 target = turned_with_head(texelFetch(u_rest, int(at)).xyz);
  const lane_bool is_sane = !is_broken(stored) && !is_broken(velocity);
  Before before;
  before.shown = select(is_sane, stored, target);
  before.dragged = select(is_sane && !is_broken(offset), stored + offset, before.shown);
  before.velocity = select(is_sane, velocity, u_step.head_velocity.xyz);
  return before;
}

// Turned from the one direction towards the other by a share of the angle between them. Between opposite ones
// no plane is better than another: the nearer of the two.
vec3 mixed(vec3 dragged, vec3 groomed, float share) {
  const float cosine = dot(dragged, groomed);
  const vec3 side = groomed - cosine * dragged;
  const float squared = dot(side, side);
  const float angle = share * atan(sqrt(squared), cosine);
  const vec3 turned = cos(angle) * dragged + sin(angle) * side * inversesqrt(max(squared, kNoPlaneSquared));
  const float straight = select(cosine > 0.0, share, floor(share + 0.5));
  return select(squared > kNoPlaneSquared, turned, mix(dragged, groomed, straight));
}

vec3 direction_of(vec3 edge, vec3 otherwise) {
  const float squared = dot(edge, edge);
  return select(squared > kTinySquared, edge * inversesqrt(squared), otherwise);
}

void main() {
  const uint stride = u_step.shape.x;
  const uint strand = gl_GlobalInvocationID.x;
  if (strand >= stride) return;
  const uint first = u_step.shape.z;
  const uint tail = u_step.shape.w;
  if (tail <= first) {
    store_pinned(strand, 0u, u_step.shape.y);
    return;
  }

  uint at = (first - 1u) * stride + strand;
  for (uint i = first - 1u; i < tail; ++i) {
    g_point[i] = vec4(state_before(at).dragged, texelFetch(u_rest, int(at)).w);
    at += stride;
  }
  const uint leader_at = (tail - 1u) * stride + strand;
  const Before leader = state_before(leader_at);
  const vec3 place = predict_from(leader_at, leader.dragged, leader.velocity).predicted;
  drag(tail - 1u, first - 1u, tail, place);
  store_pinned(strand, 0u, first);

  at = (first - 1u) * stride + strand;
  vec3 start_target = turned_with_head(texelFetch(u_rest, int(at)).xyz);
  vec3 start = start_target;
  vec3 shown_start = start_target;
  vec3 kept = start_target;
  vec3 head_before = g_point[first - 1u].xyz;
  vec3 anchor = vec3(0.0);
  float reach = 0.0;
#if HAS_PINNED_TAIL
  anchor = turned_with_head(texelFetch(u_rest, int(tail * stride + strand)).xyz);
  for (uint i = first; i <= tail; ++i) reach += texelFetch(u_rest, int(i * stride + strand)).w;
#endif
  for (uint i = first; i < tail; ++i) {
    at += stride;
    const bool is_last = i + 1u == tail;
    const Before before = state_before(at);
    const vec4 rest = texelFetch(u_rest, int(at));
    Vertex vertex;
    vertex.target = turned_with_head(rest.xyz);
    vertex.segment = rest.w;
    vertex.arc = texelFetch(u_position, int(at)).w;
    vertex.old = before.dragged;
    vertex.predicted = tractrix_followed(head_before, start, g_point[i].xyz, rest.w);
#if HAS_PINNED_TAIL
    reach -= rest.w;
    if (is_last) reach = texelFetch(u_rest, int(at + stride)).w;
#endif
    vec3 pushed;
    const vec3 end = placed(start, start_target, vertex, anchor, reach, is_last, pushed);

    const vec3 groomed = direction_of(vertex.target - start_target, vec3(0.0));
    const vec3 along = direction_of(end - start, groomed);
    vertex.old = before.shown;
    vertex.predicted = shown_start + rest.w * mixed(along, groomed, u_style_mix);
    const vec3 shown = placed(shown_start, start_target, vertex, anchor, reach, is_last, pushed);
    store_vertex(at, shown, vertex.arc);
    store_velocity(at, (is_last ? end - before.dragged : shown - before.shown) * u_step.push.w);
    // What is kept of the dragged strand takes on the style, outside of the leader's velocity.
    const float returned = u_style_return * min(1.0, style_stiffness(vertex.arc) * u_step.support.w);
    kept += rest.w * mixed(along, groomed, returned / (u_step.push.w + returned));
    b_offset.value[at] = vec4(kept - shown, 0.0);
    head_before = g_point[i].xyz;
    start = end;
    shown_start = shown;
    start_target = vertex.target;
  }
  store_pinned(strand, tail, u_step.shape.y);
}

// Serial Dynamic Follow-The-Leader: one invocation walks one strand from root to tip and keeps it in
// registers.
#include "sim/follow.glsl"

layout(local_size_x = kStrandLocalSize) in;

uint follow_head(uint at, uint begin, uint end, uint stride) {
  for (uint i = begin; i < end; ++i) {
    const vec4 state = texelFetch(u_position, int(at));
    const vec3 target = turned_with_head(texelFetch(u_rest, int(at)).xyz);
    const vec3 velocity = select(is_broken(state.xyz), vec3(0.0), (target - state.xyz) * u_step.push.w);
    store_vertex(at, target, state.w);
    store_velocity(at, velocity);
    at += stride;
  }
  return at;
}

void main() {
  const uint stride = u_step.shape.x;
  const uint strand = gl_GlobalInvocationID.x;
  if (strand >= stride) return;
  set_thickness(strand);
  const uint first = u_step.shape.z;
  const uint tail = u_step.shape.w;
  uint at = follow_head(strand, 0u, first, stride);

  vec3 start_target = turned_with_head(texelFetch(u_rest, int(at - stride)).xyz);
  vec3 start = start_target;
  vec3 anchor = vec3(0.0);
  float reach = 0.0;
#if HAS_PINNED_TAIL
  anchor = turned_with_head(texelFetch(u_rest, int(tail * stride + strand)).xyz);
  for (uint i = first; i <= tail; ++i) reach += texelFetch(u_rest, int(i * stride + strand)).w;
#endif

  // A vertex's velocity is known once the next one's correction is.
  vec3 waiting = vec3(0.0);
  for (uint i = first; i < tail; ++i) {
    const Vertex vertex = predict(at);
    const bool is_last = i + 1u == tail;
#if HAS_PINNED_TAIL
    reach -= vertex.segment;
    if (is_last) reach = texelFetch(u_rest, int(at + stride)).w;
#endif
    vec3 pushed;
    const vec3 end = placed(start, start_target, vertex, anchor, reach, is_last, pushed);
    const vec3 correction = taken_back(end - vertex.predicted - pushed, end - start);
    store_vertex(at, end, vertex.arc);
    if (i > first) store_velocity(at - stride, waiting - (u_step.style.z * u_step.push.w) * correction);
    waiting = (end - vertex.old) * u_step.push.w;
    start = end;
    start_target = vertex.target;
    at += stride;
  }
  if (tail > first) store_velocity(at - stride, waiting);
  follow_head(at, tail, u_step.shape.y, stride);
}

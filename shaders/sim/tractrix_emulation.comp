// Zappe 2020, 3.0.1: every vertex in turn goes where its forces take it and drags the others along; then the
// strand is pulled back to its root. One invocation per strand.
#include "sim/tractrix_drag.glsl"
#include "lib/hash.glsl"

layout(local_size_x = kStrandLocalSize) in;

uniform uint u_has_random_order;  // 0 = from the tip to the root
uniform uint u_order_seed;

vec3 g_wanted[kMaxVertexCount];

// A permutation of the numbers below 2^bits; server/sim/solvers/tractrix/tractrix_step.h says how.
uint shuffled(uint value, uint bits, uint key) {
  const uint mask = (1u << bits) - 1u;
  for (uint round = 0u; round < 3u; ++round) {
    key = mix_u32(key + round);
    value = (value * (key | 1u) + (key >> 16)) & mask;
    value ^= value >> ((bits + 1u) / 2u);
  }
  return value;
}

// The same order in all strands, so that they stay side by side in the lanes.
void move_all(uint first, uint tail) {
  const uint count = tail - first;
  const bool is_random = u_has_random_order != 0u;
  const uint bits = uint(findMSB(max(count - 1u, 1u))) + 1u;
  const uint key = mix_u32(u_order_seed + mix_u32(u_step.step_index));
  const uint turns = is_random ? 1u << bits : count;
  for (uint k = 0u; k < turns; ++k) {
    const uint pick = is_random ? shuffled(k, bits, key) : count - 1u - k;
    if (pick < count) drag(first + pick, first - 1u, tail, g_wanted[first + pick]);
  }
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
    const Vertex vertex = predict(at);
    g_point[i] = vec4(vertex.old, vertex.segment);
    g_wanted[i] = vertex.predicted;
    at += stride;
  }
  move_all(first, tail);
  store_pinned(strand, 0u, first);

  at = (first - 1u) * stride + strand;
  vec3 start_target = turned_with_head(texelFetch(u_rest, int(at)).xyz);
  vec3 start = start_target;
  vec3 head_before = g_point[first - 1u].xyz;
  vec3 anchor = vec3(0.0);
  float reach = 0.0;
#if HAS_PINNED_TAIL
  anchor = turned_with_head(texelFetch(u_rest, int(tail * stride + strand)).xyz);
  for (uint i = first; i <= tail; ++i) reach += texelFetch(u_rest, int(i * stride + strand)).w;
#endif
  // A vertex's velocity is known once the next one's correction is.
  vec3 waiting = vec3(0.0);
  for (uint i = first; i < tail; ++i) {
    at += stride;
    Vertex vertex = predict(at);
    const vec3 before = g_point[i].xyz;
    const vec3 predicted = vertex.predicted;
    vertex.predicted = tractrix_followed(head_before, start, before, vertex.segment);
    const bool is_last = i + 1u == tail;
#if HAS_PINNED_TAIL
    reach -= vertex.segment;
    if (is_last) reach = texelFetch(u_rest, int(at + stride)).w;
#endif
    vec3 pushed;
    const vec3 end = placed(start, start_target, vertex, anchor, reach, is_last, pushed);
    store_vertex(at, end, vertex.arc);
    const vec3 correction = end - predicted - pushed;
    if (i > first) store_velocity(at - stride, waiting - (u_step.style.z * u_step.push.w) * correction);
    waiting = (end - vertex.old) * u_step.push.w;
    head_before = before;
    start = end;
    start_target = vertex.target;
  }
  store_velocity(at, waiting);
  store_pinned(strand, tail, u_step.shape.y);
}

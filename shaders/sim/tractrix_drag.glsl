// A strand that is dragged along tractrix curves by one of its vertices.
#include "sim/tractrix.glsl"

// The strand that is dragged about. w = segment before the vertex.
vec4 g_point[kMaxVertexCount];

// Moves one vertex to a place; the others of first .. end - 1 follow. (The vertex itself is stored before the
// loops: after them, Mesa 22.3 stores to element 0.)
void drag(uint vertex, uint first, uint end, vec3 place) {
  const vec4 before = g_point[vertex];
  g_point[vertex] = vec4(place, before.w);
  vec4 head_before = before;
  vec3 head = place;
  for (uint i = vertex; i-- > first;) {
    const vec4 tail = g_point[i];
    head = tractrix_followed(head_before.xyz, head, tail.xyz, head_before.w);
    g_point[i] = vec4(head, tail.w);
    head_before = tail;
  }
  head_before = before;
  head = place;
  for (uint i = vertex + 1u; i < end; ++i) {
    const vec4 tail = g_point[i];
    head = tractrix_followed(head_before.xyz, head, tail.xyz, tail.w);
    g_point[i] = vec4(head, tail.w);
    head_before = tail;
  }
}

void store_pinned(uint strand, uint begin, uint end) {
  for (uint i = begin; i < end; ++i) {
    const uint at = i * u_step.shape.x + strand;
    const vec3 target = turned_with_head(texelFetch(u_rest, int(at)).xyz);
    const vec4 state = texelFetch(u_position, int(at));
    store_vertex(at, target, state.w);
    store_velocity(at, select(is_broken(state.xyz), vec3(0.0), (target - state.xyz) * u_step.push.w));
  }
}

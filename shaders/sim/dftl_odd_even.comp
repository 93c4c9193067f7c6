// Odd-even Dynamic Follow-The-Leader with one invocation per strand: the same placements as dftl_parallel.comp,
// walked through one after the other. For devices without shared memory of their own, where barriers between
// vertices cost more than all the work.
#include "sim/contact.glsl"

layout(local_size_x = kStrandLocalSize) in;

uniform uint u_iterations;        // times the odd and the even vertices follow their leaders
uniform uint u_has_exact_length;  // 1 = segments are laid end to end afterwards

vec4 g_point[kMaxVertexCount];  // w = segment before
vec3 g_predicted[kMaxVertexCount];
vec3 g_target[kMaxVertexCount];
#if COLLIDERS >= 1
vec3 g_pushed[kMaxVertexCount];
#endif

Vertex vertex_of(uint vertex, uint strand) {
  Vertex result;
  result.target = g_target[vertex];
  result.segment = g_point[vertex].w;
  result.predicted = g_predicted[vertex];
  result.arc = 0.0;
#if COLLIDERS >= 1
  result.old = position_before(vertex * u_step.shape.x + strand);
#else
  result.old = vec3(0.0);
#endif
  return result;
}

void place_every_second(uint strand, uint parity) {
  const uint first = u_step.shape.z;
  const uint tail = u_step.shape.w;
  const uint begin = first + ((first ^ parity) & 1u);
  vec3 anchor = vec3(0.0);
  float reach = 0.0;
#if HAS_PINNED_TAIL
  anchor = g_target[tail];
  for (uint i = begin + 1u; i <= tail; ++i) reach += g_point[i].w;
#endif
  for (uint i = begin; i < tail; i += 2u) {
#if HAS_PINNED_TAIL
    const bool is_last = i + 1u == tail;
    if (is_last) reach = g_point[tail].w;
#else
    const bool is_last = false;
#endif
    vec3 pushed;
    g_point[i].xyz =
        placed(g_point[i - 1u].xyz, g_target[i - 1u], vertex_of(i, strand), anchor, reach, is_last, pushed);
#if COLLIDERS >= 1
    g_pushed[i] = pushed;
#endif
#if HAS_PINNED_TAIL
    reach -= g_point[i + 1u].w + (is_last ? 0.0 : g_point[i + 2u].w);
#endif
  }
}

#if !HAS_PINNED_TAIL
// Keeps every segment's direction and lays the segments end to end.
void restore_lengths() {
  vec3 leader = g_point[u_step.shape.z - 1u].xyz;
  vec3 end = leader;
  for (uint i = u_step.shape.z; i < u_step.shape.w; ++i) {
    const vec4 point = g_point[i];
    const vec3 along = point.xyz - leader;
    const float squared = dot(along, along);
    leader = point.xyz;
    end += select(squared > kTinySquared, along * (point.w * inversesqrt(squared)), g_target[i] - g_target[i - 1u]);
    g_point[i].xyz = end;
  }
}
#endif

vec3 correction_of(uint vertex) {
  vec3 correction = g_point[vertex].xyz - g_predicted[vertex];
#if COLLIDERS >= 1
  correction -= g_pushed[vertex];
#endif
  return taken_back(correction, g_point[vertex].xyz - g_point[vertex - 1u].xyz);
}

void main() {
  const uint stride = u_step.shape.x;
  const uint vertices = u_step.shape.y;
  const uint first = u_step.shape.z;
  const uint tail = u_step.shape.w;
  const uint strand = gl_GlobalInvocationID.x;
  if (strand >= stride) return;
  set_thickness(strand);

  uint at = strand;
  for (uint i = 0u; i < vertices; ++i) {
    const Vertex vertex = predict(at);
    const bool is_free = i >= first && i < tail;
    g_predicted[i] = is_free ? vertex.predicted : vertex.target;
    g_point[i] = vec4(g_predicted[i], vertex.segment);
    g_target[i] = vertex.target;
#if COLLIDERS >= 1
    g_pushed[i] = vec3(0.0);
#endif
    at += stride;
  }

#if !HAS_PINNED_TAIL
  restore_lengths();
#endif
  for (uint iteration = 0u; iteration < u_iterations; ++iteration) {
    place_every_second(strand, 1u);
    place_every_second(strand, 0u);
  }
#if !HAS_PINNED_TAIL
  if (u_has_exact_length != 0u) restore_lengths();
#endif

  at = strand;
  for (uint i = 0u; i < vertices; ++i) {
    const float arc = texelFetch(u_position, int(at)).w;
    vec3 velocity = (g_point[i].xyz - position_before(at)) * u_step.push.w;
    const bool has_next = i >= first && i + 1u < tail;
    if (has_next) velocity -= (u_step.style.z * u_step.push.w) * correction_of(i + 1u);
    store_vertex(at, g_point[i].xyz, arc);
    store_velocity(at, velocity);
    at += stride;
  }
}

// Odd-even Dynamic Follow-The-Leader: one invocation per vertex, whole strands per group, positions in shared
// memory. It starts from the predicted directions laid end to end; every placement starts again from the
// prediction, so two more vertices are final after each iteration, and half as many iterations as vertices
// give the serial result.
#include "sim/follow.glsl"

layout(local_size_x = kVertexLocalSize) in;

uniform uint u_iterations;        // times the odd and the even vertices follow their leaders
uniform uint u_has_exact_length;  // 1 = segments are laid end to end afterwards

// (vertices x strands of the group), strand fastest; later reused for corrections.
shared vec3 s_point[kVertexLocalSize];
shared vec3 s_target[kVertexLocalSize];
#if HAS_PINNED_TAIL
shared float s_segment[kVertexLocalSize];
#else
shared vec3 s_sum[2u * kVertexLocalSize];
#endif

struct Lane {
  uint local;    // element of the shared arrays
  uint stride;   // strands per group
  uint index;    // vertex in its strand
  bool is_free;  // exists and does not follow the head
};

void place_in_turn(Lane lane, Vertex vertex, uint parity, vec3 anchor, float reach, inout vec3 pushed) {
  // A loop of one round rather than an if: llvmpipe skips it when no lane needs it.
  for (bool is_turn = lane.is_free && (lane.index & 1u) == parity; is_turn; is_turn = false) {
    const uint leader = lane.local - lane.stride;
    s_point[lane.local] = placed(s_point[leader], s_target[leader], vertex, anchor, reach,
                                 lane.index + 1u == u_step.shape.w, pushed);
  }
  barrier();
}

#if !HAS_PINNED_TAIL
// Keeps every segment's direction and lays the segments end to end: an inclusive sum along the strand in log2
// steps.
void restore_lengths(Lane lane, Vertex vertex) {
  vec3 sum = s_point[lane.local];
  if (lane.is_free) {
    const uint leader = lane.local - lane.stride;
    const vec3 along = sum - s_point[leader];
    const float squared = dot(along, along);
    const vec3 groomed = vertex.target - s_target[leader];
    sum = squared > kTinySquared ? along * (vertex.segment * inversesqrt(squared)) : groomed;
  } else if (lane.index + 1u != u_step.shape.z) {
    sum = vec3(0.0);  // the last pinned vertex is where the sum starts
  }
  // Sums alternate between two arrays, so that one barrier per doubling is enough.
  uint from = 0u;
  s_sum[lane.local] = sum;
  barrier();
  for (uint reach = 1u; reach < u_step.shape.y; reach *= 2u) {
    if (lane.is_free && lane.index >= reach) sum += s_sum[from + lane.local - reach * lane.stride];
    from = kVertexLocalSize - from;
    s_sum[from + lane.local] = sum;
    barrier();
  }
  if (lane.is_free) s_point[lane.local] = sum;
  barrier();
}
#endif

void main() {
  const uint strands = u_step.shape.x;
  const uint vertices = u_step.shape.y;
  Lane lane;
  lane.local = gl_LocalInvocationIndex;
  lane.stride = kVertexLocalSize / vertices;
  lane.index = lane.local / lane.stride;
  const uint strand = gl_WorkGroupID.x * lane.stride + lane.local % lane.stride;
  const bool exists = lane.index < vertices && strand < strands;
  lane.is_free = exists && lane.index >= u_step.shape.z && lane.index < u_step.shape.w;
  // Idle lanes shadow the first vertex: barriers need every invocation.
  const uint at = exists ? lane.index * strands + strand : 0u;

  set_thickness(exists ? strand : 0u);
  Vertex vertex = predict(at);
  vec3 pushed = vec3(0.0);
  if (!lane.is_free) vertex.predicted = vertex.target;
  s_point[lane.local] = vertex.predicted;
  s_target[lane.local] = vertex.target;
#if HAS_PINNED_TAIL
  s_segment[lane.local] = vertex.segment;
#endif
  barrier();

  vec3 anchor = vec3(0.0);
  float reach = 0.0;
#if HAS_PINNED_TAIL
  const uint column = lane.local % lane.stride;
  anchor = s_target[u_step.shape.w * lane.stride + column];
  if (lane.is_free) {
    for (uint i = lane.index + 1u; i <= u_step.shape.w; ++i) reach += s_segment[i * lane.stride + column];
  }
#endif

#if !HAS_PINNED_TAIL
  restore_lengths(lane, vertex);
#endif
  for (uint iteration = 0u; iteration < u_iterations; ++iteration) {
    place_in_turn(lane, vertex, 1u, anchor, reach, pushed);
    place_in_turn(lane, vertex, 0u, anchor, reach, pushed);
  }
#if !HAS_PINNED_TAIL
  if (u_has_exact_length != 0u) restore_lengths(lane, vertex);
#endif

  const vec3 end = lane.is_free ? s_point[lane.local] : vertex.target;
  const vec3 along = lane.is_free ? end - s_point[lane.local - lane.stride] : vec3(0.0);
  barrier();
  s_point[lane.local] = lane.is_free ? taken_back(end - vertex.predicted - pushed, along) : vec3(0.0);
  barrier();
  if (!exists) return;
  vec3 velocity = (end - vertex.old) * u_step.push.w;
  const bool has_next = lane.is_free && lane.index + 1u < u_step.shape.w;
  if (has_next) velocity -= (u_step.style.z * u_step.push.w) * s_point[lane.local + lane.stride];
  store_vertex(at, end, vertex.arc);
  store_velocity(at, velocity);
}

// mass_spring, explicit: one walk adds up the forces of the springs, one moves the vertices. Symplectic Euler
// and Verlet differ in where during the step the forces are taken.
#include "sim/mass_spring.glsl"

uniform float u_middle;  // where in the step forces are taken: 0 = at its start, 0.5 = half way

vec4 g_point[kMaxVertexCount];  // where forces are taken; w = mass over the mass per length
vec4 g_force[kMaxVertexCount];  // over the mass per length, m^2/s^2

void add_force(uint vertex, vec3 force) { g_force[vertex].xyz += force; }

void add_forces(uint strand, uint last) {
  const uint first = u_step.shape.z;
  const float share = u_middle * u_step.head_velocity.w;
  uint at = element(strand, first - 1u);
  vec3 velocity = velocity_before(at, false);
  vec3 position = position_before(at) + share * velocity;
  vec3 target = target_at(at);
  vec4 turn = vec4(0.0, 0.0, 0.0, 1.0);
  const vec3 clamp_edge = first >= 2u ? target - target_at(at - u_step.shape.x) : vec3(0.0);
  vec3 rest_direction = direction_of(clamp_edge, u_step.world_from_head[1].xyz);
  vec3 edge1 = vec3(0.0);
  if (first >= 2u) {
    const uint before = at - u_step.shape.x;
    edge1 = position - position_before(before) - share * velocity_before(before, false);
  }
  vec3 edge0 = vec3(0.0);
  vec3 target1 = clamp_edge;
  vec3 target0 = vec3(0.0);
  float soft1 = first >= 2u ? soft_length(texelFetch(u_rest, int(at)).w) : 1.0;
  float soft0 = soft1;
  vec3 strain1 = rest_direction;
  vec3 direction1 = rest_direction;
  vec3 groomed1 = rest_direction;
  const uint first_tetrahedron = first >= 2u ? first + 1u : first + 2u;
  g_force[first - 1u] = vec4(0.0);
  g_point[first - 1u] = vec4(position, 0.0);
  for (uint i = first; i <= last; ++i) {
    at += u_step.shape.x;
    const vec4 rest_point = texelFetch(u_rest, int(at));
    const vec3 target_now = turned_with_head(rest_point.xyz);
    const vec3 velocity_now = velocity_before(at, i < u_step.shape.w);
    const vec3 point = position_before(at) + share * velocity_now;
    const float soft = soft_length(rest_point.w);
    const vec3 edge = point - position;
    rest_direction = direction_of(target_now - target, rest_direction);
    const vec3 rest = turned_by(turn, rest_direction);
    const vec3 direction = direction_of(edge, rest);
    const vec3 strain = edge / soft + (1.0 - rest_point.w / soft) * direction;
    g_force[i] = vec4(0.0);
    g_point[i] = vec4(point, 0.5 * soft);
    g_point[i - 1u].w += 0.5 * soft;

    const float opening = dot(direction, velocity_now - velocity);
    const float stretch = dot(edge, direction) - rest_point.w;
    const vec3 pull = (u_stretch * stretch + u_stretch_damping * opening) * direction;
    add_force(i, -pull);
    add_force(i - 1u, pull);
    if (i == first) {
      add_force(i, (-2.0 * u_bend / soft) * (strain - rest));
    } else {
      const mat3 joint = rest_change(direction1, rest, groomed1);
      const vec3 stress = u_bend * (strain - joint * strain1);
      const vec3 on_after = stress / soft;
      const vec3 on_before = (stress * joint) / soft1;
      add_force(i, -on_after);
      add_force(i - 1u, on_after + on_before);
      if (i - 1u > first) add_force(i - 2u, -on_before);
    }
    if (i >= first_tetrahedron) {
      const float longest = max(max(soft0, soft1), soft);
      const float per_base = 1.0 / (longest * longest);
      const vec3 by_a = cross(edge1, edge) * per_base;
      const vec3 by_b = cross(edge, edge0) * per_base;
      const vec3 by_c = cross(edge0, edge1) * per_base;
      const float rest_altitude = dot(target0, cross(target1, target_now - target)) * per_base;
      const float push = u_altitude * (dot(edge0, by_a) - rest_altitude);
      if (i - 1u > first + 1u) add_force(i - 3u, push * by_a);
      if (i - 1u > first) add_force(i - 2u, push * (by_b - by_a));
      add_force(i - 1u, push * (by_c - by_b));
      add_force(i, -push * by_c);
    }
    turn = smallest_turn(rest_direction, direction);
    edge0 = edge1;
    edge1 = edge;
    target0 = target1;
    target1 = target_now - target;
    soft0 = soft1;
    soft1 = soft;
    strain1 = strain;
    direction1 = direction;
    groomed1 = rest_direction;
    position = point;
    target = target_now;
    velocity = velocity_now;
  }
}

void main() {
  const uint strand = gl_GlobalInvocationID.x;
  if (strand >= u_step.shape.x) return;
  const uint first = u_step.shape.z;
  const uint tail = u_step.shape.w;
#if HAS_PINNED_TAIL
  add_forces(strand, min(tail + 1u, u_step.shape.y - 1u));
#else
  add_forces(strand, u_step.shape.y - 1u);
#endif
  store_pinned(strand, 0u, first);
  const float h = u_step.head_velocity.w;
  vec3 start = target_at(element(strand, first - 1u));
  vec3 start_target = start;
  for (uint i = first; i < tail; ++i) {
    const uint at = element(strand, i);
    const Vertex vertex = predict(at);
    const vec3 impulse = g_force[i].xyz * (h / (g_point[i].w * hold(vertex.arc)));
    const vec3 velocity = within_speed_limit((vertex.predicted - vertex.old) * u_step.push.w + impulse);
    const vec3 solved = g_point[i].xyz + ((1.0 - u_middle) * h) * velocity;
    const lane_bool is_bad = is_broken(solved);
    const vec3 end = select(
        is_bad, vertex.target, finished(at, start, start_target, solved, vertex.segment, vertex.arc));
    store_vertex(at, end, vertex.arc);
    store_velocity(at, select(is_bad, vec3(0.0), velocity + (end - solved) * u_step.push.w));
    start = end;
    start_target = vertex.target;
  }
  store_pinned(strand, tail, u_step.shape.y);
}

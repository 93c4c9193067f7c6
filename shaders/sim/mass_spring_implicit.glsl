// Backward Euler for one strand per invocation: Newton steps, each of a walk from root to tip that assembles
// and eliminates a banded system and a walk back that solves it. Unknowns are displacements from the iterate,
// so that no large positions cancel; everything is divided by the mass per length.
#include "sim/mass_spring.glsl"

// Blocks on either side of the diagonal: stretch 1, bend 2, altitude 3.
const uint kReach = 2u + uint(HAS_ALTITUDE);

uniform uint u_solves;           // Newton steps
uniform float u_most_stiffness;  // of a spring over what inertia resists with

// A row of the system: what couples the vertex to itself and to those after it, and the force.
struct Row {
  mat3 diagonal;
  mat3 next;
  mat3 second;
#if HAS_ALTITUDE
  mat3 third;
#endif
  vec3 right;
};

// What later rows need of an eliminated one: its part of L^-1 U, and the same over D.
struct Eliminated {
  mat3 next;
  mat3 second;
  mat3 solved_next;
  mat3 solved_second;
#if HAS_ALTITUDE
  mat3 third;
  mat3 solved_third;
#endif
  vec3 solved_right;
};

// What stays of an edge for the joints and tetrahedra after it.
struct Edge {
  vec3 vector;
  vec3 strain;     // over the soft length; of unit length at rest
  vec3 direction;
  vec3 target;     // groomed, turned with the head
  vec3 groomed;    // its direction
  float soft;
};

vec4 g_point[kMaxVertexCount];  // iterate
vec4 g_solved[3u * kReach * kMaxVertexCount];  // columns of pivot^-1 U; w of the first three: pivot^-1 r

Row empty_row() {
  Row row;
  row.diagonal = mat3(0.0);
  row.next = mat3(0.0);
  row.second = mat3(0.0);
#if HAS_ALTITUDE
  row.third = mat3(0.0);
#endif
  row.right = vec3(0.0);
  return row;
}

Eliminated nothing_eliminated() {
  Eliminated nothing;
  nothing.next = nothing.second = nothing.solved_next = nothing.solved_second = mat3(0.0);
#if HAS_ALTITUDE
  nothing.third = nothing.solved_third = mat3(0.0);
#endif
  nothing.solved_right = vec3(0.0);
  return nothing;
}

mat3 scaled(float scale) { return mat3(scale, 0.0, 0.0, 0.0, scale, 0.0, 0.0, 0.0, scale); }

// L D L^T of a symmetric matrix. Cofactors would do in exact arithmetic: with springs of 2000 times the
// inertia they lose the inertia in float.
struct Pivot {
  vec3 lower;     // L10, L20, L21
  vec3 inverse_d;
};

Pivot factored(mat3 m) {
  Pivot pivot;
  const float d0 = 1.0 / m[0].x;
  const float l10 = m[0].y * d0;
  const float l20 = m[0].z * d0;
  const float d1 = 1.0 / (m[1].y - l10 * m[0].y);
  const float rest = m[1].z - l20 * m[0].y;
  const float l21 = rest * d1;
  pivot.lower = vec3(l10, l20, l21);
  pivot.inverse_d = vec3(d0, d1, 1.0 / (m[2].z - l20 * m[0].z - l21 * rest));
  return pivot;
}

vec3 solved_lower(Pivot pivot, vec3 v) {
  const float y = v.y - pivot.lower.x * v.x;
  return vec3(v.x, y, v.z - pivot.lower.y * v.x - pivot.lower.z * y);
}

mat3 solved_lower(Pivot pivot, mat3 m) {
  return mat3(solved_lower(pivot, m[0]), solved_lower(pivot, m[1]), solved_lower(pivot, m[2]));
}

vec3 solved_upper(Pivot pivot, vec3 v) {
  const float y = v.y - pivot.lower.z * v.z;
  return vec3(v.x - pivot.lower.x * y - pivot.lower.y * v.z, y, v.z);
}

mat3 scaled_rows(vec3 scale, mat3 m) { return mat3(scale * m[0], scale * m[1], scale * m[2]); }

// h^2 times a stiffness, no stiffer than float can tell from rigid.
float capped(float stiffness, float inertia) { return min(stiffness, u_most_stiffness * inertia); }

void add_stretch(Edge edge, float segment, float length_before, inout Row start, inout Row end) {
  const float h = u_step.head_velocity.w;
  const float length_now = dot(edge.vector, edge.direction);
  const float spring = capped(h * h * u_stretch, edge.soft);
  const float damper = capped(h * u_stretch_damping, edge.soft);
  const vec3 pull =
      (spring * (length_now - segment) + damper * (length_now - length_before)) * edge.direction;
  const float across = spring * max(length_now - segment, 0.0) / max(length_now, kFoldedBack);
  const mat3 stiffness =
      scaled(across) + outerProduct((spring + damper - across) * edge.direction, edge.direction);
  start.right += pull;
  end.right -= pull;
  start.diagonal += stiffness;
  end.diagonal += stiffness;
  start.next -= stiffness;
}

float bend_weight(float soft) {
  const float h = u_step.head_velocity.w;
  return capped(h * h * u_bend, soft * soft * soft / kBendPerStretch);
}

void add_clamp(Edge edge, vec3 rest, inout Row end) {
  const float weight = 2.0 * bend_weight(edge.soft) / edge.soft;
  end.right -= weight * (edge.strain - rest);
  end.diagonal += scaled(weight / edge.soft);
}

void add_bend(Edge before, Edge after, vec3 rest, inout Row start, inout Row middle, inout Row end) {
  const float weight = bend_weight(min(before.soft, after.soft));
  const mat3 turn = rest_change(before.direction, rest, before.groomed);
  const vec3 stress = weight * (after.strain - turn * before.strain);
  const vec3 on_after = stress / after.soft;
  const vec3 on_before = (stress * turn) / before.soft;
  start.right -= on_before;
  middle.right += on_before + on_after;
  end.right -= on_after;

  const float aa = weight / (after.soft * after.soft);
  const mat3 bb = transpose(turn) * (turn * (weight / (before.soft * before.soft)));
  const mat3 ab = turn * (weight / (after.soft * before.soft));
  const mat3 ba = transpose(ab);
  start.diagonal += bb;
  start.next -= bb + ba;
  start.second += ba;
  middle.diagonal += scaled(aa) + bb + ab + ba;
  middle.next -= scaled(aa) + ba;
  end.diagonal += scaled(aa);
}

#if HAS_ALTITUDE
void add_altitude(Edge a, Edge b, Edge c, inout Row row0, inout Row row1, inout Row row2, inout Row row3) {
  const float h = u_step.head_velocity.w;
  const float shortest = min(min(a.soft, b.soft), c.soft);
  const float longest = max(max(a.soft, b.soft), c.soft);
  const float spring = capped(h * h * u_altitude, shortest / kAltitudePerStretch);
  const float per_base = 1.0 / (longest * longest);
  const vec3 by_a = cross(b.vector, c.vector) * per_base;
  const vec3 by_b = cross(c.vector, a.vector) * per_base;
  const vec3 by_c = cross(a.vector, b.vector) * per_base;
  const float rest = dot(a.target, cross(b.target, c.target)) * per_base;
  const float error = dot(a.vector, by_a) - rest;
  const vec3 g0 = -by_a;
  const vec3 g1 = by_a - by_b;
  const vec3 g2 = by_b - by_c;
  const vec3 g3 = by_c;
  const vec3 k0 = spring * g0;
  const vec3 k1 = spring * g1;
  const vec3 k2 = spring * g2;
  const vec3 k3 = spring * g3;
  row0.right -= error * k0;
  row1.right -= error * k1;
  row2.right -= error * k2;
  row3.right -= error * k3;
  row0.diagonal += outerProduct(k0, g0);
  row0.next += outerProduct(k0, g1);
  row0.second += outerProduct(k0, g2);
  row0.third += outerProduct(k0, g3);
  row1.diagonal += outerProduct(k1, g1);
  row1.next += outerProduct(k1, g2);
  row1.second += outerProduct(k1, g3);
  row2.diagonal += outerProduct(k2, g2);
  row2.next += outerProduct(k2, g3);
  row3.diagonal += outerProduct(k3, g3);
}
#endif

void store_solved(Pivot pivot, uint vertex, uint block, mat3 columns, vec3 last) {
  const uint begin = (vertex * kReach + block) * 3u;
  for (uint c = 0u; c < 3u; ++c) g_solved[begin + c] = vec4(solved_upper(pivot, columns[c]), last[c]);
}

// Takes the rows before out of this one and stores what the way back needs. `first` is the row just before.
#if HAS_ALTITUDE
Eliminated eliminate(uint vertex, Row row, Eliminated first, Eliminated second, Eliminated third) {
#else
Eliminated eliminate(uint vertex, Row row, Eliminated first, Eliminated second) {
#endif
  const mat3 from_first = transpose(first.next);
  const mat3 from_second = transpose(second.second);
  Eliminated result;
  mat3 pivot = row.diagonal - from_first * first.solved_next - from_second * second.solved_second;
  vec3 right = row.right - first.solved_right * first.next - second.solved_right * second.second;
  result.next = row.next - from_first * first.solved_second;
  result.second = row.second;
#if HAS_ALTITUDE
  pivot -= transpose(third.third) * third.solved_third;
  right -= third.solved_right * third.third;
  result.next -= from_second * second.solved_third;
  result.second -= from_first * first.solved_third;
  result.third = row.third;
#endif
  const Pivot factors = factored(pivot);
  result.next = solved_lower(factors, result.next);
  result.second = solved_lower(factors, result.second);
  result.solved_next = scaled_rows(factors.inverse_d, result.next);
  result.solved_second = scaled_rows(factors.inverse_d, result.second);
  result.solved_right = factors.inverse_d * solved_lower(factors, right);
  store_solved(factors, vertex, 0u, result.solved_next, solved_upper(factors, result.solved_right));
  store_solved(factors, vertex, 1u, result.solved_second, vec3(0.0));
#if HAS_ALTITUDE
  result.third = solved_lower(factors, result.third);
  result.solved_third = scaled_rows(factors.inverse_d, result.third);
  store_solved(factors, vertex, 2u, result.solved_third, vec3(0.0));
#endif
  return result;
}

void forward(uint strand, uint solve) {
  const uint first = u_step.shape.z;
  const uint tail = u_step.shape.w;
#if HAS_PINNED_TAIL
  const uint last = min(tail + 1u, u_step.shape.y - 1u);
#else
  const uint last = u_step.shape.y - 1u;
#endif
  uint at = element(strand, first - 1u);
  vec3 position = target_at(at);
  vec3 target = position;
  vec3 old = position_before(at);
  vec3 held = vec3(0.0);
  float hold_before = 0.0;
  vec4 turn = vec4(0.0, 0.0, 0.0, 1.0);
  vec3 rest_direction = u_step.world_from_head[1].xyz;
  // The edge that the strand is clamped by, when there is one.
  Edge edge1;
  edge1.vector = edge1.target = first >= 2u ? target - target_at(at - u_step.shape.x) : vec3(0.0);
  edge1.direction = rest_direction = direction_of(edge1.target, rest_direction);
  edge1.strain = edge1.groomed = edge1.direction;
  edge1.soft = first >= 2u ? soft_length(texelFetch(u_rest, int(at)).w) : 1.0;
  Edge edge0 = edge1;
  const uint first_tetrahedron = first >= 2u ? first + 1u : first + 2u;

  Row row1 = empty_row();
  Row row2 = empty_row();
  Eliminated done1 = nothing_eliminated();
  Eliminated done2 = done1;
#if HAS_ALTITUDE
  Row row0 = empty_row();
  Eliminated done3 = done1;
#endif
  for (uint i = first; i < tail + kReach; ++i) {
    Row row3 = empty_row();
    if (i <= last) {
      at += u_step.shape.x;
      const Vertex vertex = predict(at);
      const vec3 goal = i >= tail ? vertex.target : vertex.predicted;
      Edge edge;
      edge.target = vertex.target - target;
      edge.soft = soft_length(vertex.segment);
      rest_direction = direction_of(edge.target, rest_direction);
      const vec3 rest = turned_by(turn, rest_direction);
      const float length_before = distance(vertex.old, old);

      vec3 point;
      if (solve > 0u) {
        point = g_point[i].xyz;
      } else {
        const vec3 velocity = within_speed_limit(velocity_before(at, true));
        point = i >= tail ? goal : vertex.old + u_step.head_velocity.w * velocity;
#if HAS_PINNED_TAIL == 0
        const float most = vertex.segment * (1.0 + u_stretch_limit);
        const float reach = clamp(length_before, max(2.0 * vertex.segment - most, 0.0), most);
        point = position + reach * direction_of(point - position, rest);
#endif
      }
      edge.vector = point - position;
      edge.direction = direction_of(edge.vector, rest);
      edge.groomed = rest_direction;
      edge.strain = edge.vector / edge.soft + (1.0 - vertex.segment / edge.soft) * edge.direction;
      g_point[i] = vec4(point, 0.0);

      // Half of the edge's mass at either end.
      const float half_mass = 0.5 * edge.soft;
      const float hold_now = hold(vertex.arc);
      const vec3 held_now = hold_now * (goal - point);
      row2.right += half_mass * held;
      row2.diagonal += scaled(half_mass * hold_before);
      row3.right += half_mass * held_now;
      row3.diagonal += scaled(half_mass * hold_now);
      held = held_now;
      hold_before = hold_now;

      add_stretch(edge, vertex.segment, length_before, row2, row3);
      if (i == first) {
        add_clamp(edge, rest, row3);
      } else {
        add_bend(edge1, edge, rest, row1, row2, row3);
      }
#if HAS_ALTITUDE
      if (i >= first_tetrahedron) add_altitude(edge0, edge1, edge, row0, row1, row2, row3);
#endif
      turn = smallest_turn(rest_direction, edge.direction);
      edge0 = edge1;
      edge1 = edge;
      position = point;
      target = vertex.target;
      old = vertex.old;
    }
#if HAS_ALTITUDE
    if (i >= first + kReach) {
      const Eliminated done = eliminate(i - kReach, row0, done1, done2, done3);
      done3 = done2;
      done2 = done1;
      done1 = done;
    }
    row0 = row1;
#else
    if (i >= first + kReach) {
      const Eliminated done = eliminate(i - kReach, row1, done1, done2);
      done2 = done1;
      done1 = done;
    }
#endif
    row1 = row2;
    row2 = row3;
  }
}

// Solves from the tip and moves the iterate; true when something came out broken.
lane_bool backward() {
  vec3 moved1 = vec3(0.0);
  vec3 moved2 = vec3(0.0);
  vec3 moved3 = vec3(0.0);
  lane_bool is_bad = lanes_that(false);
  for (uint i = u_step.shape.w; i-- > u_step.shape.z;) {
    const uint begin = i * kReach * 3u;
    const vec4 n0 = g_solved[begin];
    const vec4 n1 = g_solved[begin + 1u];
    const vec4 n2 = g_solved[begin + 2u];
    vec3 moved = vec3(n0.w, n1.w, n2.w) - (n0.xyz * moved1.x + n1.xyz * moved1.y + n2.xyz * moved1.z);
    moved -= g_solved[begin + 3u].xyz * moved2.x + g_solved[begin + 4u].xyz * moved2.y +
             g_solved[begin + 5u].xyz * moved2.z;
#if HAS_ALTITUDE
    moved -= g_solved[begin + 6u].xyz * moved3.x + g_solved[begin + 7u].xyz * moved3.y +
             g_solved[begin + 8u].xyz * moved3.z;
#endif
    is_bad = is_bad || is_broken(moved);
    g_point[i].xyz += moved;
    moved3 = moved2;
    moved2 = moved1;
    moved1 = moved;
  }
  return is_bad;
}

void finish(uint strand, lane_bool is_bad) {
  const uint first = u_step.shape.z;
  const uint tail = u_step.shape.w;
  store_pinned(strand, 0u, first);
  vec3 start = target_at(element(strand, first - 1u));
  vec3 start_target = start;
  for (uint i = first; i < tail; ++i) {
    const uint at = element(strand, i);
    const vec3 target = target_at(at);
    const float arc = texelFetch(u_position, int(at)).w;
    const float segment = texelFetch(u_rest, int(at)).w;
    const vec3 old = position_before(at);
    // A broken strand starts again from the groomed shape.
    const vec3 solved = finished(at, start, start_target, g_point[i].xyz, segment, arc);
    const vec3 end = select(is_bad, target, solved);
    store_vertex(at, end, arc);
    store_velocity(at, select(is_bad, vec3(0.0), (end - old) * u_step.push.w));
    start = end;
    start_target = target;
  }
  store_pinned(strand, tail, u_step.shape.y);
}

void main() {
  const uint strand = gl_GlobalInvocationID.x;
  if (strand >= u_step.shape.x) return;
  lane_bool is_bad = lanes_that(false);
  for (uint solve = 0u; solve < u_solves; ++solve) {
    if (u_step.shape.w > u_step.shape.z) forward(strand, solve);
    is_bad = backward() || is_bad;
  }
  finish(strand, is_bad);
}

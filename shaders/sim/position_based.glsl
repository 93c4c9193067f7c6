// pbd and xpbd: one invocation per strand; constraints one after the other from root to tip. Equations in
// server/sim/solvers/position_based/position_based.h. Masses are counted in masses of one segment, so that
// only the compliance has one.
#include "sim/contact.glsl"

layout(local_size_x = kStrandLocalSize) in;

// pbd: share of the error per iteration. xpbd: compliance times mass per length, s^2/m.
uniform float u_stretch_give;
uniform float u_bend_give;
uniform uint u_iterations;  // times all constraints are solved
#if HAS_TRACTRIX_SWEEPS
uniform uint u_tractrix_sweeps;  // 1 = from the root to the tip, 2 = from the tip first
uniform uint u_tractrix_first;   // 1 = before the iterations
#endif

// What the constraints of one vertex remember.
struct Link {
  float span;       // rest distance to the vertex before the one before
  float stretch;    // multipliers
  float bend;
};

vec4 g_point[kMaxVertexCount];  // w = segment before
Link g_link[kMaxVertexCount];

uniform_float inverse_mass(uint vertex) {
  const bool is_pinned = vertex < u_step.shape.z || vertex >= u_step.shape.w;
  return is_pinned ? 0.0 : (vertex + 1u == u_step.shape.y ? 2.0 : 1.0);
}

// How far the constraint pushes masses of 1 apart.
float push_apart(float error, uniform_float weights, float give, inout float multiplier) {
#if IS_COMPLIANT
  const float push = (-error - give * multiplier) / max(weights + give, kTinySquared);
  multiplier += push;
  return push;
#else
  return -give * error / max(weights, kTinySquared);
#endif
}

vec3 groomed_direction(uint at) {
  const vec3 groomed = turned_with_head(texelFetch(u_rest, int(at)).xyz) -
                       turned_with_head(texelFetch(u_rest, int(at - u_step.shape.x)).xyz);
  return groomed * inversesqrt(max(dot(groomed, groomed), kTinySquared));
}

vec3 contact(vec3 point, uint vertex, uint strand) {
  if (inverse_mass(vertex) == 0.0) return point;
  return outside_colliders(point, vertex * u_step.shape.x + strand);
}

// All constraints once, with the window of three vertices a, b, c in registers; a vertex that leaves it is
// final for this iteration.
void sweep(uint strand, uint last, vec2 give) {
  vec3 a = vec3(0.0);
  vec3 b = g_point[0].xyz;
  for (uint i = 1u; i <= last; ++i) {
    const vec4 state = g_point[i];
    vec3 c = state.xyz;
    Link link = g_link[i];
    const uniform_float w_a = i >= 2u ? inverse_mass(i - 2u) : 0.0;
    const uniform_float w_b = inverse_mass(i - 1u);
    const uniform_float w_c = inverse_mass(i);
    if (i >= 2u && w_a + w_c > 0.0) {
      const vec3 along = c - a;
      const float squared = dot(along, along);
      const vec3 direction = select(squared > kTinySquared, along * inversesqrt(squared), vec3(0.0));
      const float push = push_apart(sqrt(squared) - link.span, w_a + w_c, give.y, link.bend);
      a -= (w_a * push) * direction;
      c += (w_c * push) * direction;
    }
    if (w_b + w_c > 0.0) {
      const vec3 along = c - b;
      const float squared = dot(along, along);
      vec3 direction = along * inversesqrt(max(squared, kTinySquared));
      // A loop of one round rather than an if: llvmpipe skips it when no lane needs it.
      const lane_bool is_lost = squared <= kTinySquared;
      for (bool is_any_lost = is_any(is_lost); is_any_lost; is_any_lost = false) {
        direction = select(is_lost, groomed_direction(i * u_step.shape.x + strand), direction);
      }
      const float push = push_apart(sqrt(squared) - state.w, w_b + w_c, give.x, link.stretch);
      b -= (w_b * push) * direction;
      c += (w_c * push) * direction;
    }
    if (i >= 2u) g_point[i - 2u].xyz = contact(a, i - 2u, strand);
#if IS_COMPLIANT
    g_link[i] = link;
#endif
    a = b;
    b = c;
  }
  g_point[last - 1u].xyz = contact(a, last - 1u, strand);
  g_point[last].xyz = contact(b, last, strand);
}

#if HAS_TRACTRIX_SWEEPS
vec3 g_solved[kMaxVertexCount];  // what the constraints left

void sweep_from_tip(uint first, uint tail) {
  const uint last = min(tail, u_step.shape.y - 1u);
  vec4 head_before = g_point[last];
  vec3 head = head_before.xyz;
  for (uint i = last; i > first; --i) {
    const vec4 point = g_point[i - 1u];
    head = tractrix_fitted(head_before.xyz, head, point.xyz, head_before.w);
    g_point[i - 1u] = vec4(head, point.w);
    head_before = point;
  }
}

// Tractrix sweeps as a first guess for the constraints.
void guess(uint first, uint tail) {
  if (u_tractrix_sweeps > 1u) sweep_from_tip(first, tail);
  vec3 head_before = g_point[first - 1u].xyz;
  vec3 head = head_before;
  for (uint i = first; i < tail; ++i) {
    const vec4 point = g_point[i];
    head = tractrix_fitted(head_before, head, point.xyz, point.w);
    g_point[i] = vec4(head, point.w);
    head_before = point.xyz;
  }
}

// Tractrix sweeps that give what the constraints left its lengths, with colliders and a pinned tip; stores the
// free vertices. (With results back in g_point, Mesa 22.3 puts them one element further.)
void finish(uint strand, uint first, uint tail) {
  const uint stride = u_step.shape.x;
  for (uint i = first; i < tail; ++i) g_solved[i] = g_point[i].xyz;
  if (u_tractrix_sweeps > 1u) sweep_from_tip(first, tail);
  uint at = (first - 1u) * stride + strand;
  vec3 start = g_point[first - 1u].xyz;
  vec3 start_target = start;
  vec3 head_before = start;
  vec3 anchor = vec3(0.0);
  float reach = 0.0;
#if HAS_PINNED_TAIL
  anchor = turned_with_head(texelFetch(u_rest, int(tail * stride + strand)).xyz);
  for (uint i = first; i <= tail; ++i) reach += texelFetch(u_rest, int(i * stride + strand)).w;
#endif
  for (uint i = first; i < tail; ++i) {
    at += stride;
    const vec4 point = g_point[i];
    Vertex vertex = predict(at);
    vertex.predicted = tractrix_fitted(head_before, start, point.xyz, point.w);
    const bool is_last = i + 1u == tail;
#if HAS_PINNED_TAIL
    reach -= point.w;
    if (is_last) reach = texelFetch(u_rest, int(at + stride)).w;
#endif
    vec3 pushed;
    const vec3 end = placed(start, start_target, vertex, anchor, reach, is_last, pushed);
    store_vertex(at, end, vertex.arc);
    store_velocity(at, (g_solved[i] - vertex.old) * u_step.push.w);
    head_before = point.xyz;
    start = end;
    start_target = vertex.target;
  }
}
#endif

void main() {
  const uint stride = u_step.shape.x;
  const uint vertices = u_step.shape.y;
  const uint strand = gl_GlobalInvocationID.x;
  if (strand >= stride) return;

  vec3 target_a = vec3(0.0);
  vec3 target_b = vec3(0.0);
  float total = 0.0;
  uint at = strand;
  for (uint i = 0u; i < vertices; ++i) {
    const Vertex vertex = predict(at);
    const bool is_free = inverse_mass(i) > 0.0;
    g_point[i] = vec4(is_free ? outside_colliders(vertex.predicted, at) : vertex.target, vertex.segment);
    g_link[i] = Link(distance(vertex.target, target_a), 0.0, 0.0);
    total += vertex.segment;
    target_a = target_b;
    target_b = vertex.target;
    at += stride;
  }

  vec2 give = vec2(u_stretch_give, u_bend_give);
#if IS_COMPLIANT
  give *= (total / float(vertices - 1u)) * u_step.push.w * u_step.push.w;
#endif
#if HAS_TRACTRIX_SWEEPS
  const uint first = u_step.shape.z;
  const uint tail = u_step.shape.w;
  const bool is_guess = u_tractrix_first != 0u;
  if (is_guess) guess(first, tail);
#endif
  for (uint iteration = 0u; iteration < u_iterations; ++iteration) sweep(strand, vertices - 1u, give);
#if HAS_TRACTRIX_SWEEPS
  if (!is_guess) finish(strand, first, tail);
#endif

  at = strand;
  for (uint i = 0u; i < vertices; ++i) {
#if HAS_TRACTRIX_SWEEPS
    const bool is_stored = !is_guess && i >= first && i < tail;
    if (is_stored) {
      at += stride;
      continue;
    }
#endif
    const float arc = texelFetch(u_position, int(at)).w;
    const vec3 before = position_before(at);
    const vec3 point = g_point[i].xyz;
    store_vertex(at, point, arc);
    store_velocity(at, (point - before) * u_step.push.w);
    at += stride;
  }
}

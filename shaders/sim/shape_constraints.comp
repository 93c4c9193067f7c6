// Shape constraints (the TressFX model): one invocation per strand. Equations and sources in
// server/sim/solvers/shape_constraints/shape_constraints.h.
#include "sim/follow.glsl"

layout(local_size_x = kStrandLocalSize) in;

uniform float u_bend_stiffness;    // of the local shape, over mass per length, m^4/s^2
uniform uint u_shape_iterations;   // times the local shape is held
uniform float u_shape_relaxation;  // share of each correction of it
uniform uint u_iterations;         // times the lengths are held
uniform float u_stretch_limit;     // relative
uniform float u_shock_share;       // of a change of the head's motion
uniform float u_fast;              // acceleration that is fast, m/s^2
uniform float u_damping;           // 1/s
uniform float u_fast_damping;      // when fast, 1/s
uniform float u_air_along;         // drag along the strand over drag across it

const float kMostGive = 1e12;    // finite whatever the groom
const float kGiveShare = 0.375;  // see the header named above

vec4 g_point[kMaxVertexCount];      // w = segment before
vec3 g_groomed[kMaxVertexCount];    // unit vector of the groomed segment before, turned with the head
vec3 g_multiplier[kMaxVertexCount]; // of the local shape, segment before

// How the head's motion reaches a strand; velocities relative to the head joint.
struct Shock {
  vec3 root;      // where the strand was held before the substep
  vec3 velocity;  // of that point in the substep before
  float fast;     // 0 below the acceleration that is fast, 1 from twice that on
  float share;    // of a change of the head's motion that goes to the whole strand
  float kept;     // of a velocity against the head's, after damping
};

uniform_float inverse_mass(uint vertex) {
  return vertex < u_step.shape.z || vertex >= u_step.shape.w ? 0.0 : 1.0;
}

// Velocity of a point that turns with the head in this substep.
vec3 rigid_velocity(vec3 point) { return (carried_by_head(point) - point) * u_step.push.w; }

vec3 previous_turn(vec3 arm) {
  return u_step.previous_turn[0].xyz * arm.x + u_step.previous_turn[1].xyz * arm.y +
         u_step.previous_turn[2].xyz * arm.z;
}

Shock shock_of(uint strand) {
  Shock shock;
  const Vertex root = read_vertex(strand);
  shock.velocity = root.velocity;
  const vec3 now = rigid_velocity(root.old);
  // A broken root knows nothing of the step before.
  const lane_bool is_lost = is_broken(texelFetch(u_position, int(strand)).xyz) ||
                            is_broken(texelFetch(u_velocity, int(strand)).xyz);
  shock.velocity = select(is_lost, now, shock.velocity);
  shock.root = root.old;
  const float acceleration = length(now - shock.velocity) * u_step.push.w;
  shock.fast = clamp(acceleration / u_fast - 1.0, 0.0, 1.0);
  shock.share = mix(u_shock_share, 1.0, shock.fast);
  shock.kept = exp(-u_damping * u_step.head_velocity.w);
  return shock;
}

// Velocity with which a vertex starts: damped towards the motion of the head, with the share of what changed
// of that motion, and turned by the same share of the head's turn.
vec3 start_velocity(Vertex vertex, Shock shock) {
  const vec3 before = shock.velocity + previous_turn(vertex.old - shock.root);
  const vec3 now = rigid_velocity(vertex.old);
  const vec3 own = (vertex.velocity - before) * shock.kept;
  return mix(own, carried_by_head(own), shock.share) + mix(before, now, shock.share);
}

// As predict(), with a velocity of its own and less drag along `along`, a unit vector or zero.
void advance(inout Vertex vertex, vec3 velocity, vec3 along) {
  const float h = u_step.head_velocity.w;
  const float drag = h * u_step.contact.y;
  const float along_drag = drag * u_air_along;
  const float stiffness = style_stiffness(vertex.arc);
  const float brake = h * pull_rate(stiffness);
  const vec3 air = u_step.wind.xyz + gust_velocity(vertex.old);
  const vec3 weight = u_step.push.xyz - drag * u_step.wind.xyz + support_of(stiffness);
  vec3 moved = velocity + weight + pulled(vertex, stiffness);
  moved += drag * air + ((along_drag - drag) * dot(air, along)) * along;
  const float across_share = 1.0 / (1.0 + brake + drag);
  const float along_share = 1.0 / (1.0 + brake + along_drag);
  moved = across_share * moved + ((along_share - across_share) * dot(moved, along)) * along;
  vertex.predicted = vertex.old + h * within_speed_limit(moved);
}

// The unit vector, or `otherwise` for a vector without direction.
vec3 direction_of(vec3 along, vec3 otherwise) {
  const float squared = dot(along, along);
  return select(squared > kTinySquared, along * inversesqrt(squared), otherwise);
}

// The vector turned as the shortest turn from one unit vector to another: mirrored twice.
vec3 turned_from_to(vec3 from, vec3 to, vec3 vector) {
  const vec3 sum = from + to;
  const float scale = dot(sum, vector) / max(1.0 + dot(from, to), 0.5 * dot(sum, sum) + kTinySquared);
  return vector - scale * sum + (2.0 * dot(from, vector)) * to;
}

// Every segment once from root to tip: turned about its middle towards its groomed angle to the segment
// before it, as placed by then.
void hold_shape(uint last, float give, float relaxation) {
  vec3 a = g_point[0].xyz;
  vec3 groomed_before = g_groomed[1];
  vec3 before = groomed_before;  // the first segment's angle is that to the head
  for (uint i = 1u; i <= last; ++i) {
    const vec4 state = g_point[i];
    vec3 b = state.xyz;
    const vec3 groomed = g_groomed[i];
    const uniform_float w_a = inverse_mass(i - 1u);
    const uniform_float w_b = inverse_mass(i);
    const vec3 wanted = state.w * turned_from_to(groomed_before, before, groomed);
    const vec3 multiplier = g_multiplier[i];
    vec3 push = -(b - a - wanted + give * multiplier) / (w_a + w_b + give);
    push = w_a + w_b > 0.0 ? relaxation * push : vec3(0.0);
    g_multiplier[i] = multiplier + push;
    a -= w_a * push;
    b += w_b * push;
    g_point[i - 1u].xyz = a;
    before = direction_of(b - a, before);
    groomed_before = groomed;
    a = b;
  }
  g_point[last].xyz = a;
}

void project_length(inout vec3 a, inout vec3 b, uniform_float w_a, uniform_float w_b, float segment, vec3 groomed) {
  const vec3 along = b - a;
  const float squared = dot(along, along);
  const lane_bool has_direction = squared > kTinySquared;
  const float inverse = inversesqrt(max(squared, kTinySquared));
  const vec3 direction = select(has_direction, along * inverse, groomed);
  const float share = (squared * inverse - segment) / max(w_a + w_b, 1.0);
  a += (w_a * share) * direction;
  b -= (w_b * share) * direction;
}

// Segments after even vertices, then those after odd ones. No two of a colour share a vertex, so an odd one
// may follow as soon as both its even neighbours are done: one walk does both colours.
void hold_lengths(uint last) {
  vec3 before = vec3(0.0);  // end of the pair before
  for (uint i = 0u; i <= last; i += 2u) {
    const vec4 state = g_point[i];
    vec3 a = state.xyz;
    vec3 b = a;
    const uint next = min(i + 1u, last);
    const uniform_float w_a = inverse_mass(i);
    if (next > i) {
      const vec4 next_state = g_point[next];
      b = next_state.xyz;
      project_length(a, b, w_a, inverse_mass(next), next_state.w, g_groomed[next]);
    }
    if (i > 0u) {
      project_length(before, a, inverse_mass(i - 1u), w_a, state.w, g_groomed[i]);
      g_point[i - 1u].xyz = before;
    }
    g_point[i].xyz = a;
    before = b;
    if (next > i && next == last) g_point[last].xyz = b;
  }
}

// The last walk, from root to tip: every segment is given a length within the limit and turned out of
// colliders. While the acceleration is fast the limit is 0: the ad-hoc pass. Stores the vertices.
void finish(uint strand, float fast) {
  const uint stride = u_step.shape.x;
  const uint first = u_step.shape.z;
  const uint tail = u_step.shape.w;
  const vec2 limit = vec2(1.0) + vec2(-1.0, 1.0) * ((1.0 - fast) * u_stretch_limit);
  const float kept = exp(-u_fast_damping * fast * u_step.head_velocity.w);
  vec3 anchor = vec3(0.0);
  float reach = 0.0;
#if HAS_PINNED_TAIL
  anchor = g_point[tail].xyz;
  for (uint i = first; i <= tail; ++i) reach += g_point[i].w;
#endif
  vec3 start = g_point[0].xyz;
  uint at = strand;
  for (uint i = 0u; i < u_step.shape.y; ++i) {
    Vertex vertex = read_vertex(at);
    const vec4 state = g_point[i];
    vec3 end = state.xyz;
    vec3 velocity = (end - vertex.old) * u_step.push.w;
    if (i >= first && i < tail) {
      vertex.predicted = end;
      vertex.target = g_groomed[i];
      vertex.segment = clamp(distance(end, start), limit.x * state.w, limit.y * state.w);
      const bool is_last = i + 1u == tail;
      float longest = 0.0;
#if HAS_PINNED_TAIL
      reach -= state.w;
      longest = limit.y * reach;
      const float after = g_point[tail].w;
      if (is_last) longest = clamp(distance(end, anchor), limit.x * after, limit.y * after);
#endif
      vec3 pushed;
      end = placed(start, vec3(0.0), vertex, anchor, longest, is_last, pushed);
      const vec3 rigid = rigid_velocity(vertex.old);
      velocity = mix(rigid, (end - vertex.old) * u_step.push.w, kept);
    }
    store_vertex(at, end, vertex.arc);
    store_velocity(at, velocity);
    start = end;
    at += stride;
  }
}

// Predicts all vertices and notes the groomed segments; returns the rest length of what is not pinned.
float begin_strand(uint strand, Shock shock) {
  const uint stride = u_step.shape.x;
  vec3 target_before = vec3(0.0);
  vec3 old_before = vec3(0.0);
  vec3 groomed = vec3(0.0, 1.0, 0.0);
  float total = 0.0;
  uint at = strand;
  for (uint i = 0u; i < u_step.shape.y; ++i) {
    Vertex vertex = read_vertex(at);
    if (inverse_mass(i) > 0.0) {
      const vec3 along = direction_of(vertex.old - old_before, vec3(0.0));
      advance(vertex, start_velocity(vertex, shock), along);
    }
    groomed = direction_of(vertex.target - target_before, groomed);
    g_point[i] = vec4(inverse_mass(i) > 0.0 ? vertex.predicted : vertex.target, vertex.segment);
    g_groomed[i] = groomed;
    g_multiplier[i] = vec3(0.0);
    total += i < u_step.shape.z ? 0.0 : vertex.segment;
    target_before = vertex.target;
    old_before = vertex.old;
    at += stride;
  }
  return total;
}

void main() {
  const uint stride = u_step.shape.x;
  const uint vertices = u_step.shape.y;
  const uint strand = gl_GlobalInvocationID.x;
  if (strand >= stride) return;
  const uint last = vertices - 1u;
  const float h = u_step.head_velocity.w;

  const Shock shock = shock_of(strand);
  const float total = begin_strand(strand, shock);
  const float segment = total / float(max(vertices - u_step.shape.z, 1u));
  const float stiffness = max(u_bend_stiffness * h * h, kTinySquared);
  const float give = kGiveShare * total * segment * segment * segment / stiffness;
  const float relaxation = u_shape_relaxation;
  for (uint round = 0u; round < u_shape_iterations; ++round)
    hold_shape(last, min(give, kMostGive), relaxation);
  for (uint iteration = 0u; iteration < u_iterations; ++iteration) hold_lengths(last);
  finish(strand, shock.fast);
}

// What the kernels of mass_spring share: constants of the springs, rotations, and the last pass over a
// strand. Model and equations in server/sim/solvers/mass_spring/mass_spring.h; stiffnesses are divided by the
// mass per length and, where multiplied by h^2, are lengths.
#include "sim/contact.glsl"

layout(local_size_x = kStrandLocalSize) in;

// Springs, over the mass per length.
uniform float u_stretch;          // m/s^2
uniform float u_stretch_damping;  // m/s
uniform float u_bend;             // m^3/s^2
uniform float u_altitude;         // m/s^2
uniform float u_shortest_segment;  // for mass and leverage, m
uniform float u_stretch_limit;     // relative

const float kFoldedBack = 1e-6;
// Closer than 16 degrees to the reverse of its groomed direction, an edge turns less about itself than the
// smallest rotation would: bending stays within what float and explicit steps bear, not quite of one energy.
const float kNearlyReversed = 0.02;
const float kFarAway = 1e30;
const float kBendPerStretch = 4.0;
const float kAltitudePerStretch = 9.0;

uint element(uint strand, uint vertex) { return vertex * u_step.shape.x + strand; }

vec3 target_at(uint at) { return turned_with_head(texelFetch(u_rest, int(at)).xyz); }

float soft_length(float segment) { return max(segment, u_shortest_segment); }

// Velocity before the substep relative to the head joint, as predict() sees it.
vec3 velocity_before(uint at, bool is_free) {
  const vec3 stored = texelFetch(u_velocity, int(at)).xyz;
  const lane_bool is_sane = !is_broken(stored) && !is_broken(texelFetch(u_position, int(at)).xyz);
  const vec3 with_head = (target_at(at) - position_before(at)) * u_step.push.w;
  return is_free ? select(is_sane, stored - u_step.head_velocity.xyz, vec3(0.0)) : with_head;
}

// How hard a vertex holds to its prediction: inertia, drag and pull.
float hold(float arc) {
  const float h = u_step.head_velocity.w;
  return 1.0 + h * (u_step.contact.y + pull_rate(style_stiffness(arc)));
}

// The vector's direction, or the other one where it has none.
vec3 direction_of(vec3 vector, vec3 other) {
  const float squared = dot(vector, vector);
  return select(squared > kTinySquared, vector * inversesqrt(squared), other);
}

// Quaternion of the smallest turn between two directions.
vec4 smallest_turn(vec3 from, vec3 to) {
  const vec4 turn = vec4(cross(from, to), 1.0 + dot(from, to));
  const vec3 side = select(abs(from.x) < 0.6, vec3(0.0, from.z, -from.y), vec3(-from.z, 0.0, from.x));
  return normalize(select(turn.w > kFoldedBack, turn, vec4(side, 0.0)));
}

vec3 turned_by(vec4 turn, vec3 vector) {
  return vector + 2.0 * cross(turn.xyz, cross(turn.xyz, vector) + turn.w * vector);
}

// How s u, the strain of the edge after a joint at rest, changes with the strain s t of the edge before,
// which is groomed along r: u turns with the smallest turn from r to t. It takes t to u.
mat3 rest_change(vec3 t, vec3 u, vec3 r) {
  const float cosine = dot(t, u);
  const vec3 twist = cross(r, t) / max(1.0 + dot(r, t), kNearlyReversed);
  const mat3 identity = mat3(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
  return cosine * identity + outerProduct(u, t) - outerProduct(t, u) - outerProduct(cross(t, u), twist);
}

// Vertices that follow the head.
void store_pinned(uint strand, uint begin, uint end) {
  for (uint i = begin; i < end; ++i) {
    const uint at = element(strand, i);
    const vec3 target = target_at(at);
    const float arc = texelFetch(u_position, int(at)).w;
    const vec3 way = target - position_before(at);
    store_vertex(at, target, arc);
    store_velocity(at, way * u_step.push.w);
  }
}

// The end of a segment that the springs put at `solved`: within the limit of stretch, outside the colliders.
vec3 finished(uint at, vec3 start, vec3 start_target, vec3 solved, float segment, float arc) {
  const vec3 edge = solved - start;
  float reach = sqrt(dot(edge, edge));
#if HAS_PINNED_TAIL == 0
  const float most = segment * (1.0 + u_stretch_limit);
  reach = clamp(reach, max(2.0 * segment - most, 0.0), most);
#endif
  Vertex vertex;
  vertex.target = target_at(at);
  vertex.segment = reach;
  vertex.old = position_before(at);
  vertex.arc = arc;
  vertex.predicted = solved;
  vec3 pushed;
  return placed(start, start_target, vertex, vec3(0.0), kFarAway, false, pushed);
}

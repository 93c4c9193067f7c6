// Strands as chains of rigid segments, one invocation per strand: frames that are carried along without
// twist, where a step starts from, the moment of a joint, and how a step ends. articulated and
// angular_projection say how the segments turn. Masses are lengths: everything is divided by the mass per
// length. Moments are multiplied by the step squared.
#include "sim/follow.glsl"

layout(local_size_x = kStrandLocalSize) in;

uniform float u_bend_stiffness;   // over mass per length, m^4/s^2
uniform float u_twist_stiffness;  // over mass per length, m^4/s^2
uniform float u_bending_damping;  // moments lead by this time, s
uniform uint u_rounds;            // times the segments turn per step

// A pinned tip is a vertex of so many strands' mass at its target, and takes at least so many rounds.
const float kAnchorMass = 100.0;
const uint kHeldRounds = 2u;
// Largest turn of a segment per round.
const float kMaxTurn = 1.0;

vec4 g_aim[kMaxVertexCount];    // predicted position; inertia
vec4 g_along[kMaxVertexCount];  // direction of the edge before; its length
vec4 g_axis[kMaxVertexCount];   // first axis of its frame
vec4 g_rest[kMaxVertexCount];   // its rest direction, seen from the frame before
vec4 g_turn[kMaxVertexCount];   // how far it turned during the step

// A segment counts for at least this length where something is divided by it.
const float kMinLength = 1e-5;
// 1 + cos below this: the segment folds back.
const float kFoldedBack = 1e-6;
const float kMaxHalfSineSquared = 0.5;

// Direction and a first axis across it; the second one is cross(along, axis).
struct Frame {
  vec3 along;
  vec3 axis;
};

vec3 any_perpendicular(vec3 direction) {
  const vec3 other = select(abs(direction.x) < 0.6, vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0));
  return normalize(cross(direction, other));
}

vec3 direction_or(vec3 edge, vec3 otherwise) {
  const float squared = dot(edge, edge);
  return select(squared > kTinySquared, edge * inversesqrt(squared), otherwise);
}

// The frame turned by the smallest rotation that brings it to another direction.
Frame carried_to(Frame frame, vec3 along) {
  const float sum = max(1.0 + dot(frame.along, along), kFoldedBack);
  vec3 axis = frame.axis - (dot(frame.axis, along) / sum) * (frame.along + along);
  axis -= along * dot(axis, along);
  return Frame(along, axis * inversesqrt(max(dot(axis, axis), kTinySquared)));
}

// The frame turned about its direction; `half_tangent` = tan(angle / 2).
Frame spun(Frame frame, float half_tangent) {
  const float squared = half_tangent * half_tangent;
  const vec3 second = cross(frame.along, frame.axis);
  const vec3 axis = ((1.0 - squared) * frame.axis + (2.0 * half_tangent) * second) / (1.0 + squared);
  return Frame(frame.along, axis);
}

// tan(angle / 2) of the spin from one frame to another of the same direction.
float spin_between(Frame from, Frame to) {
  const float sine = dot(to.axis, cross(from.along, from.axis));
  const float cosine = dot(to.axis, from.axis);
  return sine / max(1.0 + cosine, 1e-3);
}

// The frame turned by a rotation vector (Cayley's map: by 2 atan of half of it).
Frame turned(Frame frame, vec3 rotation) {
  const vec3 half_way = 0.5 * rotation;
  const float scale = 2.0 / (1.0 + dot(half_way, half_way));
  const vec3 along_by = cross(half_way, frame.along);
  const vec3 axis_by = cross(half_way, frame.axis);
  const vec3 along = normalize(frame.along + scale * (along_by + cross(half_way, along_by)));
  vec3 axis = frame.axis + scale * (axis_by + cross(half_way, axis_by));
  axis -= along * dot(axis, along);
  return Frame(along, normalize(axis));
}

// Rotation vector between two frames, with the sine for the angle.
vec3 turn_between(Frame from, Frame to) {
  return 0.5 * (cross(from.along, to.along) + cross(from.axis, to.axis) +
                cross(cross(from.along, from.axis), cross(to.along, to.axis)));
}

// A direction in the frame: shares of axis, second axis and direction.
vec3 seen_from(Frame frame, vec3 direction) {
  return vec3(dot(direction, frame.axis), dot(direction, cross(frame.along, frame.axis)),
              dot(direction, frame.along));
}
vec3 out_of(Frame frame, vec3 seen) {
  return seen.x * frame.axis + seen.y * cross(frame.along, frame.axis) + seen.z * frame.along;
}

Frame turned_with_head(Frame frame) {
  return Frame(turned_with_head(frame.along), turned_with_head(frame.axis));
}

vec3 rest_at(uint at) { return texelFetch(u_rest, int(at)).xyz; }

// Where the strand leaves the head, in head space: the direction of the last pinned edge, or of the first
// free one.
Frame clamp_in_head(uint strand) {
  const uint end = max(min(u_step.shape.z, u_step.shape.y) - 1u, 1u) * u_step.shape.x + strand;
  const vec3 along = direction_or(rest_at(end) - rest_at(end - u_step.shape.x), vec3(0.0, 1.0, 0.0));
  return Frame(along, any_perpendicular(along));
}

// Where a segment points after a step without forces; it turns by its own length at most.
vec3 guessed_edge(Vertex start, Vertex end) {
  const vec3 moved = u_step.head_velocity.w * (end.velocity - start.velocity);
  const float share = min(1.0, end.segment * inversesqrt(max(dot(moved, moved), kTinySquared)));
  return end.old - start.old + share * moved;
}

// theta / sin(theta) from sin^2(theta / 2) = q: asin(s) / s as its power series, over cos(theta / 2).
float angle_per_sine(float q) {
  const float high = 15.0 / 336.0 + q * (105.0 / 3456.0 + q * (945.0 / 42240.0 + q * (10395.0 / 599040.0)));
  const float series = 1.0 + q * (1.0 / 6.0 + q * (3.0 / 40.0 + q * high));
  return series * inversesqrt(1.0 - q);
}

// Moment that turns `to` away from `from` over the stiffness: their angle about the axis between them.
vec3 bend_between(vec3 from, vec3 to) {
  const vec3 d = to - from;
  return angle_per_sine(min(0.25 * dot(d, d), kMaxHalfSineSquared)) * cross(from, to);
}

// Stiffness of the joint at the clamp (server/sim/solvers/direct_rod/direct_rod_rest.h derives it).
float clamp_stiffness(float b, float tension, float segment) {
  const float pull = max(tension, 0.0) * segment * segment;
  return (b + 0.5 * sqrt(b * pull) + sqrt(b * (b + 0.25 * pull))) / segment;
}

mat3 scaled(float scale) { return mat3(scale, 0.0, 0.0, 0.0, scale, 0.0, 0.0, 0.0, scale); }

// Inverse of a symmetric matrix by cofactors.
mat3 symmetric_inverse(mat3 m) {
  const vec3 c0 = cross(m[1], m[2]);
  const vec3 c1 = cross(m[2], m[0]);
  const vec3 c2 = cross(m[0], m[1]);
  const float inverse = 1.0 / dot(m[0], c0);
  return mat3(c0 * inverse, c1 * inverse, c2 * inverse);
}

struct Strand {
  uint index;
  uint first;   // vertices first .. last are solved for
  uint last;
  Frame clamp;
  vec3 clamp_turn;  // during the step
  vec3 root;
};

Frame frame_at(Strand strand, uint i) {
  return i < strand.first ? strand.clamp : Frame(g_along[i].xyz, g_axis[i].xyz);
}

// Fills the arrays; returns the position of the last vertex.
vec3 begin(Strand strand) {
  const uint stride = u_step.shape.x;
  uint at = (strand.first - 1u) * stride + strand.index;
  Vertex before = predict(at);
  vec3 rest_before = rest_at(at);
  Frame rest = clamp_in_head(strand.index);
  Frame old = Frame(before_the_turn(strand.clamp.along), before_the_turn(strand.clamp.axis));
  Frame now = strand.clamp;
  vec3 position = strand.root;
  float total = 0.0;
  for (uint i = strand.first; i <= strand.last; ++i) {
    at += stride;
    const Vertex vertex = predict(at);
    const vec3 rest_end = rest_at(at);
    const Frame rest_next = carried_to(rest, direction_or(rest_end - rest_before, rest.along));
    g_rest[i] = vec4(seen_from(rest, rest_next.along), 0.0);
    rest = rest_next;
    rest_before = rest_end;

    const vec3 groomed = turned_with_head(rest.along);
    old = carried_to(old, direction_or(vertex.old - before.old, before_the_turn(groomed)));
    now = carried_to(now, direction_or(guessed_edge(before, vertex), groomed));
    const float stored = texelFetch(u_velocity, int(at)).w;
    const float spin = select(is_broken(vec3(stored, 0.0, 0.0)), 0.0, stored);
    const Frame turned_now = spun(now, spin);
    g_along[i] = vec4(turned_now.along, vertex.segment);
    g_axis[i] = vec4(turned_now.axis, 0.0);
    g_turn[i] = vec4(turn_between(spun(old, spin), turned_now), 0.0);

    const float half_mass = 0.5 * max(vertex.segment, kMinLength);
    if (i > strand.first) g_aim[i - 1u].w += half_mass * before.inertia;
    g_aim[i] = vec4(vertex.predicted, half_mass * vertex.inertia);
    total += half_mass;
    position += vertex.segment * turned_now.along;
    before = vertex;
  }
#if HAS_PINNED_TAIL
  g_aim[strand.last] = vec4(turned_with_head(rest_at(at)), 2.0 * kAnchorMass * total);
#endif
  return position;
}

void store(uint at, vec3 position, float arc, vec3 velocity, float spin) {
  store_vertex(at, position, arc);
  b_velocity.velocity[at] = vec4(within_speed_limit(velocity) + u_step.head_velocity.xyz, spin);
}

void store_pinned(uint i, uint strand) {
  const uint at = i * u_step.shape.x + strand;
  const Vertex vertex = predict(at);
  store(at, vertex.target, vertex.arc, (vertex.target - vertex.old) * u_step.push.w, 0.0);
}

// Positions, turned out of colliders and back to a pinned tip where need be. What the solves leave of the
// way to a pinned tip is spread over the strand: the last segments alone would answer to every rounding.
void finish(Strand strand, vec3 last_position, lane_bool is_bad) {
  const uint stride = u_step.shape.x;
  const uint tail = u_step.shape.w;
  vec3 anchor = vec3(0.0);
  float reach = 0.0;
#if HAS_PINNED_TAIL
  anchor = turned_with_head(rest_at(tail * stride + strand.index));
  for (uint i = strand.first; i <= tail; ++i) reach += g_along[i].w;
  const vec3 missed = (anchor - last_position) / max(reach, kMinLength);
  float way = 0.0;
#endif
  vec3 start = strand.root;
  vec3 solved = strand.root;
  vec3 start_target = strand.root;
  Frame untwisted = strand.clamp;
  for (uint i = strand.first; i < tail; ++i) {
    const uint at = i * stride + strand.index;
    Vertex vertex = predict(at);
    const vec3 groomed = direction_or(vertex.target - start_target, strand.clamp.along);
    const vec3 along = select(is_bad, groomed, g_along[i].xyz);
    untwisted = carried_to(untwisted, along);
    const float spin = select(is_bad, 0.0, spin_between(untwisted, Frame(along, g_axis[i].xyz)));
    const lane_bool is_shifted = start != solved;
    solved += vertex.segment * along;
    vec3 end = solved;
#if COLLIDERS > 0 || HAS_PINNED_TAIL
    vertex.predicted = solved;
    vec3 pushed;
    bool is_last = false;
#if HAS_PINNED_TAIL
    reach -= vertex.segment;
    way += vertex.segment;
    vertex.predicted += way * missed;
    is_last = i + 1u == tail;
    const float reach_left = is_last ? g_along[tail].w : reach;
    end = placed(start, start_target, vertex, anchor, reach_left, is_last, pushed);
#else
    const vec3 placed_end = placed(start, start_target, vertex, anchor, reach, is_last, pushed);
    // Without contact nothing moves, not by a rounding either.
    end = select(is_shifted || dot(pushed, pushed) > 0.0, placed_end, solved);
#endif
#endif
    const vec3 velocity = select(is_bad, vec3(0.0), (end - vertex.old) * u_step.push.w);
    store(at, end, vertex.arc, velocity, spin);
    start = end;
    start_target = vertex.target;
  }
}

Strand make_strand(uint index) {
  const uint stride = u_step.shape.x;
  Strand strand;
  strand.index = index;
  strand.first = u_step.shape.z;
  strand.last = min(u_step.shape.w, u_step.shape.y - 1u);
  strand.clamp = turned_with_head(clamp_in_head(index));
  const Frame old_clamp = Frame(before_the_turn(strand.clamp.along), before_the_turn(strand.clamp.axis));
  strand.clamp_turn = turn_between(old_clamp, strand.clamp);
  strand.root = turned_with_head(rest_at((strand.first - 1u) * stride + index));
  return strand;
}

// Of the model: turns all segments once; takes and returns the position of the last vertex.
vec3 turned_chain(Strand strand, vec3 position, inout lane_bool is_bad);

void main() {
  const uint tail = u_step.shape.w;
  const uint index = gl_GlobalInvocationID.x;
  if (index >= u_step.shape.x) return;
  const uint first = u_step.shape.z;
  if (tail > first) {
    const Strand strand = make_strand(index);
    lane_bool is_bad = lanes_that(false);
    vec3 position = begin(strand);
#if HAS_PINNED_TAIL
    const uint rounds = max(u_rounds, kHeldRounds);
#else
    const uint rounds = u_rounds;
#endif
    for (uint round = 0u; round < rounds; ++round) position = turned_chain(strand, position, is_bad);
    finish(strand, position, is_bad);
  }
  for (uint i = 0u; i < first; ++i) store_pinned(i, index);
  for (uint i = max(tail, first); i < u_step.shape.y; ++i) store_pinned(i, index);
}

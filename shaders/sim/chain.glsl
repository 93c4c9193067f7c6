// Strands as chains of rigid segments: directions, frames that are carried along without twist, and where a
// step starts from. Both versions of articulated and angular_projection state the equations in
// server/sim/solvers/articulated/articulated.h.
#include "sim/follow.glsl"

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
  const vec3 other = abs(direction.x) < 0.6 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0);
  return normalize(cross(direction, other));
}

vec3 direction_or(vec3 edge, vec3 otherwise) {
  const float squared = dot(edge, edge);
  return squared > kTinySquared ? edge * inversesqrt(squared) : otherwise;
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
// Where a direction that goes with the head pointed before the substep.
vec3 before_the_turn(vec3 direction) {
  return vec3(dot(u_step.carry[0].xyz, direction), dot(u_step.carry[1].xyz, direction),
              dot(u_step.carry[2].xyz, direction));
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

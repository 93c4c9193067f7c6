// articulated: inertia as every joint feels it, from the tip to the root, then how far every segment turns,
// from the root to the tip (articulated-body method). Equations in
// server/sim/solvers/articulated/articulated.h.
#include "sim/chain.glsl"

// Segments have no inertia about themselves. This much of the one across, which only slows how twist spreads,
// keeps the matrices regular.
const float kSpinShare = 1e-4;
const float kPivotShare = 1e-6;
// 1 + cos of a joint's angle, or of its twist, counts for at least this much.
const float kMinOpening = 0.1;

// turn = w of 0..2 - (0..2) movement of its start + (3..5) turn before
vec4 g_back[6 * kMaxVertexCount];

// Energy of a part of the strand as a function of how its first joint moves (v) and its segment turns (w):
// 1/2 w A w + w B v + 1/2 v C v - w turn - v push.
struct Body {
  mat3 a;
  mat3 b;
  mat3 c;
  vec3 turn;
  vec3 push;
};

// Adds vertex i at the end of its segment, then moves the reference from that end to its start. The force on
// everything beyond stretches the segment, which makes it as hard to turn as a pendulum.
void extend(inout Body body, uint i, vec3 force, vec3 force_beyond) {
  const float segment = max(g_along[i].w, kMinLength);
  const vec3 along = g_along[i].xyz;
  const vec3 r = segment * along;
  const float mass = g_aim[i].w;
  body.c += scaled(mass);
  body.push += force;
  const mat3 b_before = transpose(body.b);
  body.b += mat3(cross(r, body.c[0]), cross(r, body.c[1]), cross(r, body.c[2]));
  const mat3 b_now = transpose(body.b);
  body.a += mat3(cross(r, b_now[0]), cross(r, b_now[1]), cross(r, b_now[2]));
  body.a += transpose(mat3(cross(r, b_before[0]), cross(r, b_before[1]), cross(r, b_before[2])));
  const float pull = segment * max(dot(force_beyond, along), 0.0);
  body.a += scaled(pull) - outerProduct(pull * along, along);
  const float guard = kPivotShare * (body.a[0].x + body.a[1].y + body.a[2].z);
  body.a += scaled(guard) + outerProduct((kSpinShare * mass * segment * segment) * along, along);
  body.turn += cross(r, body.push);
}

// What the joint before segment i resists with.
struct Joint {
  mat3 stiffness;
  vec3 moment;  // gradient of its energy when the segment turns
};

Joint joint_at(Strand strand, uint i, float tension) {
  const float h = u_step.head_velocity.w;
  const Frame before = frame_at(strand, i - 1u);
  const Frame now = Frame(g_along[i].xyz, g_axis[i].xyz);
  const Frame rest = carried_to(before, out_of(before, g_rest[i].xyz));
  const float segment = max(g_along[i].w, kMinLength);
  const bool is_clamp = i == strand.first;
  const float span = is_clamp ? segment : segment + max(g_along[i - 1u].w, kMinLength);
  const float tension_m2ps2 = tension * u_step.push.w * u_step.push.w;
  const float clamp_bend = clamp_stiffness(u_bend_stiffness, tension_m2ps2, segment);
  const float bend = h * h * (is_clamp ? clamp_bend : 2.0 * u_bend_stiffness / span);
  const float twist = h * h * 2.0 * u_twist_stiffness / span;

  const float opening = 1.0 / max(1.0 + dot(rest.along, now.along), kMinOpening);
  const vec3 middle = (rest.along + now.along) * opening;
  const Frame untwisted = carried_to(rest, now.along);
  const float sine = dot(now.axis, cross(untwisted.along, untwisted.axis));
  const float angle = 2.0 * sine / max(1.0 + dot(now.axis, untwisted.axis), kMinOpening);

  const vec3 axis = direction_or(middle, now.along);
  const mat3 elastic = scaled(bend) + outerProduct((twist * dot(middle, middle) - bend) * axis, axis);
  const vec3 turn_before = is_clamp ? strand.clamp_turn : g_turn[i - 1u].xyz;
  const float rate = u_bending_damping * u_step.push.w;
  Joint joint;
  joint.moment = bend * bend_between(rest.along, now.along) + (twist * angle) * middle +
                 rate * (elastic * (g_turn[i].xyz - turn_before));
  joint.stiffness = (1.0 + rate) * elastic;
  return joint;
}

// Lets segment i turn freely against its joint; what is left is the body as the segment before feels it.
void release(inout Body body, Joint joint, uint i) {
  const mat3 inverse = symmetric_inverse(body.a + joint.stiffness);
  const mat3 with_turn = inverse * joint.stiffness;
  const mat3 with_move = inverse * body.b;
  const vec3 net = body.turn - joint.moment;
  const vec3 free = inverse * net;
  for (int k = 0; k < 3; ++k) {
    g_back[6u * i + uint(k)] = vec4(with_move[k], free[k]);
    g_back[6u * i + 3u + uint(k)] = vec4(with_turn[k], 0.0);
  }
  const mat3 carried = transpose(with_turn);
  const mat3 a = body.a * with_turn;
  const mat3 c = body.c - transpose(body.b) * with_move;
  body.turn = body.a * (inverse * joint.moment) + carried * body.turn;
  body.push -= net * with_move;
  body.b = carried * body.b;
  body.a = 0.5 * (a + transpose(a));
  body.c = 0.5 * (c + transpose(c));
}

void solve_backward(Strand strand, vec3 position) {
  Body body = Body(mat3(0.0), mat3(0.0), mat3(0.0), vec3(0.0), vec3(0.0));
  vec3 force_beyond = vec3(0.0);
  for (uint i = strand.last; i >= strand.first; --i) {
    const vec3 force = g_aim[i].w * (g_aim[i].xyz - position);
    force_beyond += force;
    extend(body, i, force, force_beyond);
    release(body, joint_at(strand, i, dot(force_beyond, g_along[i].xyz)), i);
    position -= g_along[i].w * g_along[i].xyz;
  }
}

// Turns the segments; returns the position of the last vertex.
vec3 solve_forward(Strand strand, inout lane_bool is_bad) {
  vec3 turn_before = vec3(0.0);
  vec3 moved = vec3(0.0);
  vec3 position = strand.root;
  for (uint i = strand.first; i <= strand.last; ++i) {
    const vec4 b0 = g_back[6u * i];
    const vec4 b1 = g_back[6u * i + 1u];
    const vec4 b2 = g_back[6u * i + 2u];
    const mat3 with_turn =
        mat3(g_back[6u * i + 3u].xyz, g_back[6u * i + 4u].xyz, g_back[6u * i + 5u].xyz);
    vec3 turn = vec3(b0.w, b1.w, b2.w) - mat3(b0.xyz, b1.xyz, b2.xyz) * moved + with_turn * turn_before;
    is_bad = is_bad || is_broken(turn);
    const Frame before = Frame(g_along[i].xyz, g_axis[i].xyz);
    const float segment = g_along[i].w;
    moved += cross(turn, max(segment, kMinLength) * before.along);
    turn_before = turn;
    turn *= min(1.0, kMaxTurn * inversesqrt(max(dot(turn, turn), kTinySquared)));
    const Frame now = turned(before, turn);
    g_along[i] = vec4(now.along, segment);
    g_axis[i] = vec4(now.axis, 0.0);
    g_turn[i].xyz += turn;
    position += segment * now.along;
  }
  return position;
}

vec3 turned_chain(Strand strand, vec3 position, inout lane_bool is_bad) {
  solve_backward(strand, position);
  return solve_forward(strand, is_bad);
}

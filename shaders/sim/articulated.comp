// articulated: one invocation per strand; equations in server/sim/solvers/articulated/articulated.h. Walks
// per step: from the root, where a step without forces would lead; per solve from the tip to the root,
// inertia as the joints see it (articulated-body method), and back, how far every segment turns; last the
// positions. Masses are lengths: everything is divided by the mass per length. Moments are multiplied by the
// step squared.
#include "sim/chain.glsl"

layout(local_size_x = kStrandLocalSize) in;

// Bending and twist stiffness over mass per length, m^4/s^2; damping, s; solves.
uniform vec4 u_chain;

// A pinned tip is a vertex of so many strands' mass at its target.
const uint kHeldSolves = 2u;  // least number that closes the way to it
const float kAnchorMass = 100.0;
// Segments have no inertia about themselves. This much of the one across, which only slows how twist spreads,
// keeps the matrices regular.
const float kSpinShare = 1e-4;
const float kPivotShare = 1e-6;
// Largest turn of a segment per solve.
const float kMaxTurn = 1.0;
// 1 + cos of a joint's angle, or of its twist, counts for at least this much.
const float kMinOpening = 0.1;

vec4 g_aim[kMaxVertexCount];       // predicted position; inertia
vec4 g_along[kMaxVertexCount];     // direction of the edge before; its length
vec4 g_axis[kMaxVertexCount];      // first axis of its frame
vec4 g_rest[kMaxVertexCount];      // its rest direction, seen from the frame before
vec4 g_turn[kMaxVertexCount];      // how far it turned during the step
// turn = w of 0..2 - (0..2) movement of its start + (3..5) turn before
vec4 g_back[6 * kMaxVertexCount];

struct Strand {
  uint index;
  uint first;   // vertices first .. last are solved for
  uint last;
  Frame clamp;
  vec3 clamp_turn;  // during the step
  vec3 root;
};

// Energy of a part of the strand as a function of how its first joint moves (v) and its segment turns (w):
// 1/2 w A w + w B v + 1/2 v C v - w turn - v push.
struct Body {
  mat3 a;
  mat3 b;
  mat3 c;
  vec3 turn;
  vec3 push;
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
    const float spin = is_broken(vec3(stored, 0.0, 0.0)) ? 0.0 : stored;
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
  const float clamp_bend = clamp_stiffness(u_chain.x, tension * u_step.push.w * u_step.push.w, segment);
  const float bend = h * h * (is_clamp ? clamp_bend : 2.0 * u_chain.x / span);
  const float twist = h * h * 2.0 * u_chain.y / span;

  const float opening = 1.0 / max(1.0 + dot(rest.along, now.along), kMinOpening);
  const vec3 middle = (rest.along + now.along) * opening;
  const Frame untwisted = carried_to(rest, now.along);
  const float sine = dot(now.axis, cross(untwisted.along, untwisted.axis));
  const float angle = 2.0 * sine / max(1.0 + dot(now.axis, untwisted.axis), kMinOpening);

  const vec3 axis = direction_or(middle, now.along);
  const mat3 elastic = scaled(bend) + outerProduct((twist * dot(middle, middle) - bend) * axis, axis);
  const vec3 turn_before = is_clamp ? strand.clamp_turn : g_turn[i - 1u].xyz;
  const float rate = u_chain.z * u_step.push.w;
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
vec3 solve_forward(Strand strand, inout bool is_bad) {
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
void finish(Strand strand, vec3 last_position, bool is_bad) {
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
    const vec3 along = is_bad ? groomed : g_along[i].xyz;
    untwisted = carried_to(untwisted, along);
    const float spin = is_bad ? 0.0 : spin_between(untwisted, Frame(along, g_axis[i].xyz));
    const bool is_shifted = start != solved;
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
    end = is_shifted || dot(pushed, pushed) > 0.0 ? placed_end : solved;
#endif
#endif
    const vec3 velocity = is_bad ? vec3(0.0) : (end - vertex.old) * u_step.push.w;
    store(at, end, vertex.arc, velocity, spin);
    start = end;
    start_target = vertex.target;
  }
}

void main() {
  const uint stride = u_step.shape.x;
  const uint tail = u_step.shape.w;
  Strand strand;
  strand.index = gl_GlobalInvocationID.x;
  if (strand.index >= stride) return;
  strand.first = u_step.shape.z;
  strand.last = min(tail, u_step.shape.y - 1u);
  if (tail > strand.first) {
    strand.clamp = turned_with_head(clamp_in_head(strand.index));
    const Frame old_clamp = Frame(before_the_turn(strand.clamp.along), before_the_turn(strand.clamp.axis));
    strand.clamp_turn = turn_between(old_clamp, strand.clamp);
    strand.root = turned_with_head(rest_at((strand.first - 1u) * stride + strand.index));
    bool is_bad = false;
    vec3 position = begin(strand);
#if HAS_PINNED_TAIL
    const uint solves = max(uint(u_chain.w), kHeldSolves);
#else
    const uint solves = uint(u_chain.w);
#endif
    for (uint solve = 0u; solve < solves; ++solve) {
      solve_backward(strand, position);
      position = solve_forward(strand, is_bad);
    }
    finish(strand, position, is_bad);
  }
  for (uint i = 0u; i < strand.first; ++i) store_pinned(i, strand.index);
  for (uint i = max(tail, strand.first); i < u_step.shape.y; ++i) store_pinned(i, strand.index);
}

// direct_rod: one invocation per strand. Three walks along the strand per step: forward, from the root,
// assembles and eliminates the banded system as it goes; backward solves it; the finish restores lengths,
// meets colliders and stores the state. Equations in server/sim/solvers/direct_rod/direct_rod.h and
// direct_rod_reference.cpp; every quantity is per mass per length.
#include "sim/follow.glsl"

layout(local_size_x = kStrandLocalSize) in;

// Planes of one vertex per strand: position, velocity, displacement and velocity change as in step.glsl, with
// w of the velocity = tension of the edge that ends there, and for vertex 0 the length of the step before (0
// = none).
layout(binding = kUnitDisplacement) uniform samplerBuffer u_displacement;       // world, m
layout(binding = kUnitVelocityChange) uniform samplerBuffer u_velocity_change;  // world, m/s
// Rest direction in the frame of the edge before; w = length.
layout(binding = kUnitRodEdge) uniform samplerBuffer u_edge;
// Two planes: clamp direction, mean length of a free edge; frame axis at the clamp.
layout(binding = kUnitRodStrand) uniform samplerBuffer u_strand;
layout(std430, binding = kBindingDisplacement) writeonly restrict buffer DisplacementBlock {
  vec4 value[];
} b_displacement;
layout(std430, binding = kBindingVelocityChange) writeonly restrict buffer VelocityChangeBlock {
  vec4 value[];
} b_velocity_change;
layout(std430, binding = kBindingRodScratch) restrict buffer RodScratchBlock { vec4 value[]; } b_scratch;

uniform float u_stiffness;        // EI / (rho A), m^4/s^2
uniform float u_bending_damping;  // s
uniform uint u_solves;
uniform uint u_order;
uniform uint u_strand_begin;  // strands of this dispatch
uniform uint u_strand_end;

const float kSoftShare = 0.1;
const float kMinSoftLength = 1e-5;
const float kTensionPerCrossing = 3.0;
const float kMaxTrendPerSegment = 0.1;
const float kMaxHalfSineSquared = 0.5;
const float kMaxStepRatio = 8.0;
const float kFoldedBack = 1e-6;
// Stiffness so many times the inertia is beyond hair and beyond float: a few roundings of it are added to the
// pivots, which keeps them positive.
const float kMaxStiffnessPerInertia = 3e5;
const float kPivotGuard = 3e-7;

// Planes of the scratch buffer, per vertex.
const uint kPlaneNext = 0u;      // 3: columns of pivot^-1 U1; w = pivot^-1 r
const uint kPlaneSecond = 3u;    // 3: columns of pivot^-1 U2
const uint kPlaneIterate = 6u;   // position of the iterate; w = tension
const uint kScratchPlanes = 7u;

// What stays the same along a strand.
struct Rod {
  uint strand;
  uint stride;
  uint slot;        // of the scratch
  uint slots;
  uint first;       // free vertices are first .. tail - 1
  uint tail;
  float h;
  float inverse_h;
  float history_h;
  float now;        // backward differences: h rate = now (x - x_n) - before (x_n - x_(n-1))
  float before;
  float ratio;      // of this step to the one before, 0 without a history
  vec3 clamp_direction;
  vec3 frame_axis;
  float mean_segment;
  float penalty;
  vec3 force;       // gravity and drag towards the mean wind, world
};

// State of one vertex before the step.
struct Node {
  vec3 stored;           // position as stored
  vec3 old;              // relative to where the head joint is now
  vec3 velocity;
  float tension;
  vec3 displacement;
  vec3 velocity_change;
};

// A row of the system while it is assembled.
struct Row {
  mat3 diagonal;
  mat3 next;
  mat3 second;
  vec3 right;
};

// What later rows need of an eliminated one.
struct Eliminated {
  mat3 next;
  mat3 second;
  mat3 solved_next;
  mat3 solved_second;
  vec3 solved_right;
};

uint element(Rod rod, uint vertex) { return vertex * rod.stride + rod.strand; }

vec4 scratch(Rod rod, uint plane, uint vertex) {
  return b_scratch.value[(vertex * kScratchPlanes + plane) * rod.slots + rod.slot];
}
void store_scratch(Rod rod, uint plane, uint vertex, vec4 value) {
  b_scratch.value[(vertex * kScratchPlanes + plane) * rod.slots + rod.slot] = value;
}

float soft_length(Rod rod, float segment) {
  return max(segment, max(kSoftShare * rod.mean_segment, kMinSoftLength));
}

// A vertex faster than the limit starts again from the limit, without a history.
Node load_node(Rod rod, uint at) {
  Node node;
  node.stored = texelFetch(u_position, int(at)).xyz;
  node.old = node.stored - rod.h * u_step.head_velocity.xyz;
  const vec4 velocity = texelFetch(u_velocity, int(at));
  node.velocity = velocity.xyz;
  node.tension = velocity.w;
  node.displacement = texelFetch(u_displacement, int(at)).xyz;
  node.velocity_change = texelFetch(u_velocity_change, int(at)).xyz;
  const vec3 relative = node.velocity - u_step.head_velocity.xyz;
  if (dot(relative, relative) > u_step.style.w * u_step.style.w) {
    node.velocity = u_step.head_velocity.xyz + within_speed_limit(relative);
    node.displacement = rod.history_h * node.velocity;
    node.velocity_change = vec3(0.0);
  }
  return node;
}

vec3 target_at(uint at) { return turned_with_head(texelFetch(u_rest, int(at)).xyz); }

// Direction of the edge that ends at `at`; the groomed one where it has none.
vec3 edge_direction(Rod rod, vec3 edge, uint at) {
  const float squared = dot(edge, edge);
  if (squared > kTinySquared) return edge * inversesqrt(squared);
  const vec3 groomed = target_at(at) - target_at(at - rod.stride);
  const float groomed_squared = dot(groomed, groomed);
  return groomed_squared > kTinySquared ? groomed * inversesqrt(groomed_squared) : rod.clamp_direction;
}

vec3 carried_axis(vec3 axis, vec3 from, vec3 to) {
  const float sum = max(1.0 + dot(from, to), kFoldedBack);
  vec3 result = axis - (dot(axis, to) / sum) * (from + to);
  result -= to * dot(result, to);
  return normalize(result);
}

vec3 rate_at(Rod rod, vec3 position, Node node) {
  return (rod.now * (position - node.old) - rod.before * node.displacement) * rod.inverse_h;
}

// Where a vertex gets to when its velocity goes on changing as it did, within reason.
vec3 predicted(Rod rod, Node node) {
  const vec3 trend = rod.ratio * node.velocity_change;
  const float most = kMaxTrendPerSegment * rod.mean_segment * rod.inverse_h;
  const float share = min(1.0, most * inversesqrt(max(dot(trend, trend), kTinySquared)));
  const vec3 velocity = node.velocity + share * trend;
  return node.old + (rod.h * velocity + rod.before * node.displacement) / rod.now;
}

mat3 scaled(float scale) { return mat3(scale, 0.0, 0.0, 0.0, scale, 0.0, 0.0, 0.0, scale); }

// scale * (1 - d d^T)
mat3 across(vec3 d, float scale) { return scaled(scale) - outerProduct(d * scale, d); }

float clamp_stiffness(float tension, float segment) {
  const float b = u_stiffness;
  const float pull = max(tension, 0.0) * segment * segment;
  return (b + 0.5 * sqrt(b * pull) + sqrt(b * (b + 0.25 * pull))) / segment;
}

// theta / sin(theta) from sin^2(theta / 2) = q: asin(s) / s as its power series, over cos(theta / 2).
float angle_per_sine(float q) {
  const float high = 15.0 / 336.0 + q * (105.0 / 3456.0 + q * (945.0 / 42240.0 + q * (10395.0 / 599040.0)));
  const float series = 1.0 + q * (1.0 / 6.0 + q * (3.0 / 40.0 + q * high));
  return series * inversesqrt(1.0 - q);
}

// Inverse of a symmetric matrix by cofactors.
mat3 symmetric_inverse(mat3 m) {
  const vec3 c0 = cross(m[1], m[2]);
  const vec3 c1 = cross(m[2], m[0]);
  const vec3 c2 = cross(m[0], m[1]);
  const float inverse = 1.0 / dot(m[0], c0);
  return mat3(c0 * inverse, c1 * inverse, c2 * inverse);
}

Row empty_row() { return Row(mat3(0.0), mat3(0.0), mat3(0.0), vec3(0.0)); }

// Inertia and outer forces of a vertex, times `mass`.
void add_inertia(Rod rod, float mass, vec3 force, inout Row row) {
  const float rate = rod.now * rod.inverse_h;
  row.diagonal += scaled(mass * rate * (rate + u_step.contact.y));
  row.right += mass * force;
}

// Force on a vertex that moves as the iterate says, without the rod's own.
vec3 outer_force(Rod rod, Node node, vec3 rate) {
  const vec3 acceleration =
      (rod.now * (rate - node.velocity) - rod.before * node.velocity_change) * rod.inverse_h;
  const float drag = u_step.contact.y;
  return rod.force + drag * (gust_velocity(node.stored) - rate) - acceleration;
}

// The joint between two edges: strain d = after - rest, changed by -A with the edge before and by C with the
// one after.
struct Joint {
  vec3 before;
  vec3 after;
  vec3 rest;
  vec3 rest_rate;     // of a clamp; else computed
  vec3 rate_before;   // of the edge before
  vec3 rate_after;
  float length_before;  // 0 = clamped there
  float length_after;   // 0 = clamped there
  float stiffness;
};

void add_bending(Rod rod, Joint joint, inout Row row0, inout Row row1, inout Row row2) {
  const vec3 d = joint.after - joint.rest;
  float weight = joint.stiffness * angle_per_sine(min(0.25 * dot(d, d), kMaxHalfSineSquared));
  const float along = dot(joint.before, joint.rest);
  const vec3 side = joint.rest - along * joint.before;
  const float to_before = joint.length_before > 0.0 ? 1.0 / joint.length_before : 0.0;
  const float to_after = joint.length_after > 0.0 ? 1.0 / joint.length_after : 0.0;

  const vec3 moved_before =
      (joint.rate_before - joint.before * dot(joint.before, joint.rate_before)) * to_before;
  const vec3 moved_after = (joint.rate_after - joint.after * dot(joint.after, joint.rate_after)) * to_after;
  const vec3 rest_rate =
      along * moved_before - joint.before * dot(joint.rest, moved_before) + joint.rest_rate;
  const vec3 stress = weight * (d + u_bending_damping * (moved_after - rest_rate));

  // Transposes of C and A times the stress.
  const vec3 on_after = (stress - joint.after * dot(joint.after, stress)) * to_after;
  const vec3 turned = along * stress - joint.rest * dot(joint.before, stress);
  const vec3 on_before = (turned - joint.before * dot(joint.before, turned)) * to_before;
  row0.right -= on_before;
  row1.right += on_before + on_after;
  row2.right -= on_after;

  weight *= 1.0 + u_bending_damping * rod.now * rod.inverse_h;
  const float cosine = dot(joint.before, joint.after);
  const vec3 before = joint.before;
  const vec3 after = joint.after;
  const mat3 bb = across(after, weight * to_after * to_after);
  const float both = weight * to_before * to_after;
  const float only = weight * to_before * to_before;
  const mat3 aa = across(before, only * along * along) + outerProduct(only * side, side);
  // -A^T C = side (P_after before)^T - along P_before P_after
  const mat3 turned_both =
      across(before, both * along) - outerProduct((both * along) * (after - cosine * before), after);
  const mat3 ab = outerProduct(both * side, before - cosine * after) - turned_both;
  const mat3 ba = transpose(ab);
  row0.diagonal += aa;
  row0.next += ab - aa;
  row0.second -= ab;
  row1.diagonal += aa + bb - ab - ba;
  row1.next += ab - bb;
  row2.diagonal += bb;
}

// Takes the two rows before out of this one and stores what the way back needs. Symmetry is kept by hand: in
// float the factorisation of more than 48 vertices breaks down without.
Eliminated eliminate(Rod rod, uint vertex, Row row, Eliminated first, Eliminated second) {
  mat3 pivot = row.diagonal - transpose(first.next) * first.solved_next -
               transpose(second.second) * second.solved_second;
  pivot = 0.5 * (pivot + transpose(pivot));
  const float trace = row.diagonal[0].x + row.diagonal[1].y + row.diagonal[2].z;
  const float inertia = rod.mean_segment * rod.now * rod.now * rod.inverse_h * rod.inverse_h;
  const float guard = kPivotGuard * max(trace - kMaxStiffnessPerInertia * inertia, 0.0);
  const mat3 inverse = symmetric_inverse(pivot + scaled(guard));
  Eliminated result;
  result.next = row.next - transpose(first.next) * first.solved_second;
  result.second = row.second;
  const vec3 right = row.right - first.solved_right * first.next - second.solved_right * second.second;
  result.solved_next = inverse * result.next;
  result.solved_second = inverse * result.second;
  result.solved_right = inverse * right;
  for (int c = 0; c < 3; ++c) {
    store_scratch(rod, kPlaneNext + uint(c), vertex, vec4(result.solved_next[c], result.solved_right[c]));
    store_scratch(rod, kPlaneSecond + uint(c), vertex, vec4(result.solved_second[c], 0.0));
  }
  return result;
}

void forward(Rod rod, uint solve) {
#if HAS_PINNED_TAIL
  const uint last = min(rod.tail + 1u, u_step.shape.y - 1u);
#else
  const uint last = u_step.shape.y - 1u;
#endif
  uint at = element(rod, rod.first - 1u);
  vec3 position = target_at(at);
  vec3 unrestored = position;
  Node node = load_node(rod, at);
  vec3 rate = rate_at(rod, position, node);
  vec3 force = vec3(0.0);
  vec3 before = rod.clamp_direction;
  vec3 axis = rod.frame_axis;
  vec3 edge_rate = vec3(0.0);
  float length_before = 0.0;
  float tension_before = 0.0;
  Row row0 = empty_row();
  Row row1 = empty_row();
  const Eliminated nothing = Eliminated(mat3(0.0), mat3(0.0), mat3(0.0), mat3(0.0), vec3(0.0));
  Eliminated done1 = nothing;
  Eliminated done2 = nothing;
  for (uint i = rod.first; i < min(last + 3u, rod.tail + 2u); ++i) {
    Row row2 = empty_row();
    if (i <= last) {
      at += rod.stride;
      const vec4 edge_rest = texelFetch(u_edge, int(at));
      const float soft = soft_length(rod, edge_rest.w);
      node = load_node(rod, at);
      vec4 iterate;
      if (solve == 0u) {
        iterate = vec4(predicted(rod, node), node.tension);
      } else {
        iterate = scratch(rod, kPlaneIterate, i);
      }
      if (i >= rod.tail) iterate.xyz = target_at(at);
      const vec3 edge = iterate.xyz - unrestored;
      const vec3 after = edge_direction(rod, edge, at);
      unrestored = iterate.xyz;
      float excess = 0.0;
#if HAS_PINNED_TAIL
      const vec3 moved = iterate.xyz;
      excess = dot(edge, after) - edge_rest.w;
#else
      const vec3 moved = position + edge_rest.w * after;
#endif
      store_scratch(rod, kPlaneIterate, i, vec4(moved, iterate.w));
      const vec3 rate_before = edge_rate;
      const vec3 moved_rate = rate_at(rod, moved, node);
      edge_rate = moved_rate - rate;
      rate = moved_rate;
      position = moved;

      // The edge: half of its mass at either end, and its tension.
      add_inertia(rod, 0.5 * soft, force, row1);
      force = outer_force(rod, node, rate);
      add_inertia(rod, 0.5 * soft, force, row2);
      const float per_length = rod.penalty / soft;
      const float transverse = max(iterate.w, 0.0) / soft;
      const vec3 pull = (iterate.w + per_length * excess) * after;
      const mat3 stiffness = scaled(transverse) + outerProduct((per_length - transverse) * after, after);
      row1.right += pull;
      row2.right -= pull;
      row1.diagonal += stiffness;
      row2.diagonal += stiffness;
      row1.next -= stiffness;

      Joint joint;
      joint.before = before;
      joint.after = after;
      joint.rest = edge_rest.x * axis + edge_rest.y * cross(before, axis) + edge_rest.z * before;
      joint.rest_rate = vec3(0.0);
      joint.rate_before = rate_before;
      joint.rate_after = edge_rate;
      joint.length_before = length_before;
      joint.length_after = soft;
      joint.stiffness = 2.0 * u_stiffness / (length_before + soft);
      if (i == rod.first) {
        const vec3 carried = vec3(dot(u_step.carry[0].xyz, joint.rest), dot(u_step.carry[1].xyz, joint.rest),
                                  dot(u_step.carry[2].xyz, joint.rest));
        joint.rest_rate = (joint.rest - carried) * rod.inverse_h;
        joint.stiffness = clamp_stiffness(iterate.w, soft);
      }
      if (i > rod.tail) {
        joint.length_after = 0.0;
        joint.stiffness = clamp_stiffness(tension_before, length_before);
      }
      add_bending(rod, joint, row0, row1, row2);
      axis = carried_axis(axis, before, after);
      before = after;
      length_before = soft;
      tension_before = iterate.w;
    }
    if (i >= rod.first + 2u) {
      const Eliminated done = eliminate(rod, i - 2u, row0, done1, done2);
      done2 = done1;
      done1 = done;
    }
    row0 = row1;
    row1 = row2;
  }
}

// Solves from the tip, moves the iterate and updates the tensions; true when something came out broken.
bool backward(Rod rod) {
  vec3 moved1 = vec3(0.0);
  vec3 moved2 = vec3(0.0);
  bool is_bad = false;
  vec4 ahead = vec4(0.0);
#if HAS_PINNED_TAIL
  ahead = scratch(rod, kPlaneIterate, rod.tail);
#endif
  for (uint i = rod.tail; i-- > rod.first - 1u;) {
    vec4 iterate;
    vec3 moved = vec3(0.0);
    if (i >= rod.first) {
      iterate = scratch(rod, kPlaneIterate, i);
      const vec4 n0 = scratch(rod, kPlaneNext, i);
      const vec4 n1 = scratch(rod, kPlaneNext + 1u, i);
      const vec4 n2 = scratch(rod, kPlaneNext + 2u, i);
      const mat3 second = mat3(scratch(rod, kPlaneSecond, i).xyz, scratch(rod, kPlaneSecond + 1u, i).xyz,
                               scratch(rod, kPlaneSecond + 2u, i).xyz);
      moved = vec3(n0.w, n1.w, n2.w) - mat3(n0.xyz, n1.xyz, n2.xyz) * moved1 - second * moved2;
      is_bad = is_bad || is_broken(moved);
    } else {
      iterate = vec4(target_at(element(rod, i)), 0.0);
    }
    // The edge after vertex i; without a pinned tail there is none behind the tip.
    if (i + 1u < rod.tail || HAS_PINNED_TAIL == 1) {
      const uint end = element(rod, i + 1u);
      const float segment = texelFetch(u_edge, int(end)).w;
      const vec3 edge = ahead.xyz - iterate.xyz;
      const vec3 direction = edge_direction(rod, edge, end);
      float excess = 0.0;
#if HAS_PINNED_TAIL
      excess = dot(edge, direction) - segment;
#endif
      ahead.w += rod.penalty / soft_length(rod, segment) * (excess + dot(direction, moved1 - moved));
      store_scratch(rod, kPlaneIterate, i + 1u, vec4(ahead.xyz + moved1, ahead.w));
    }
    ahead = iterate;
    moved2 = moved1;
    moved1 = moved;
  }
  return is_bad;
}

void store_node(uint at, vec3 position, vec3 velocity, float tension, vec3 displacement,
                vec3 velocity_change) {
  b_position.position[at] = vec4(position, 0.0);
  b_velocity.velocity[at] = vec4(velocity, tension);
  b_displacement.value[at] = vec4(displacement, 0.0);
  b_velocity_change.value[at] = vec4(velocity_change, 0.0);
}

void store_pinned(Rod rod, uint vertex, float kept) {
  const uint at = element(rod, vertex);
  const vec3 target = target_at(at);
  const vec3 way = target - load_node(rod, at).old;
  store_node(at, target, way * rod.inverse_h, kept, way, vec3(0.0));
}

// Exact lengths, colliders, velocities. What colliders or a pinned tip move a vertex by counts as an impulse:
// once in the velocity, not in its history, which order 2 would turn into a rebound.
void finish(Rod rod) {
  vec3 restored = target_at(element(rod, rod.first - 1u));
  vec3 unrestored = restored;
  vec3 start = restored;
  for (uint i = 0u; i < rod.first; ++i) store_pinned(rod, i, i == 0u ? rod.h : 0.0);
#if HAS_PINNED_TAIL
  const vec3 anchor = target_at(element(rod, rod.tail));
  float reach = 0.0;
  for (uint i = rod.first; i <= rod.tail; ++i) reach += texelFetch(u_edge, int(element(rod, i))).w;
#endif
  for (uint i = rod.first; i < rod.tail; ++i) {
    const uint at = element(rod, i);
    const float segment = texelFetch(u_edge, int(at)).w;
    const Node node = load_node(rod, at);
    const vec4 solved = scratch(rod, kPlaneIterate, i);
    const vec3 along = edge_direction(rod, solved.xyz - unrestored, at);
    unrestored = solved.xyz;
#if HAS_PINNED_TAIL
    restored = solved.xyz;
#else
    const bool is_shifted = start != restored;
    restored += segment * along;
#endif
    vec3 end = restored;
#if HAS_PINNED_TAIL || COLLIDERS > 0
    Vertex vertex;
    vertex.target = segment * along;
    vertex.segment = segment;
    vertex.old = node.stored;
    vertex.arc = 0.0;
    vertex.predicted = restored;
    vec3 pushed;
#if HAS_PINNED_TAIL
    reach -= segment;
    if (i + 1u == rod.tail) reach = texelFetch(u_edge, int(at + rod.stride)).w;
    end = placed(start, vec3(0.0), vertex, anchor, reach, i + 1u == rod.tail, pushed);
#else
    const vec3 placed_end = placed(start, vec3(0.0), vertex, vec3(0.0), 0.0, false, pushed);
    // Without contact nothing moves, not by a rounding either.
    end = is_shifted || dot(pushed, pushed) > 0.0 ? placed_end : restored;
#endif
#endif
    const vec3 velocity = rate_at(rod, restored, node);
    const vec3 impulse = (end - restored) * rod.inverse_h;
    store_node(at, end, velocity + impulse, solved.w, end - node.old, velocity - node.velocity);
    start = end;
  }
  for (uint i = rod.tail; i < u_step.shape.y; ++i) {
    store_pinned(rod, i, i == rod.tail && rod.tail > rod.first ? scratch(rod, kPlaneIterate, i).w : 0.0);
  }
}

// A broken strand starts again from the groomed shape.
void reset(Rod rod) {
  for (uint i = 0u; i < u_step.shape.y; ++i) {
    const uint at = element(rod, i);
    store_node(at, target_at(at), u_step.head_velocity.xyz, 0.0, vec3(0.0), vec3(0.0));
  }
}

Rod make_rod(uint strand) {
  Rod rod;
  rod.strand = strand;
  rod.stride = u_step.shape.x;
  rod.slot = strand - u_strand_begin;
  rod.slots = u_strand_end - u_strand_begin;
  rod.first = u_step.shape.z;
  rod.tail = u_step.shape.w;
  rod.h = u_step.head_velocity.w;
  rod.inverse_h = u_step.push.w;
  rod.history_h = texelFetch(u_velocity, int(strand)).w;
  rod.now = 1.0;
  rod.before = 0.0;
  rod.ratio = 0.0;
  if (u_order > 1u && rod.history_h > 0.0 && rod.h <= kMaxStepRatio * rod.history_h) {
    rod.ratio = rod.h / rod.history_h;
    rod.now = (1.0 + 2.0 * rod.ratio) / (1.0 + rod.ratio);
    rod.before = rod.ratio * rod.ratio / (1.0 + rod.ratio);
  }
  const vec4 clamp_and_mean = texelFetch(u_strand, int(strand));
  rod.clamp_direction = turned_with_head(clamp_and_mean.xyz);
  rod.frame_axis = turned_with_head(texelFetch(u_strand, int(rod.stride + strand)).xyz);
  rod.mean_segment = clamp_and_mean.w;

  // The block's push is the relative velocity gained from gravity and wind; drag is against the world here.
  rod.force = u_step.push.xyz * rod.inverse_h + u_step.contact.y * u_step.head_velocity.xyz;
  const float rate = rod.mean_segment * float(u_step.shape.y - rod.first) * rod.now * rod.inverse_h;
  rod.penalty = kTensionPerCrossing * rate * rate;
  return rod;
}

void main() {
  const uint strand = u_strand_begin + gl_GlobalInvocationID.x;
  if (strand >= u_strand_end) return;
  const Rod rod = make_rod(strand);
  bool is_bad = false;
  for (uint solve = 0u; solve < u_solves; ++solve) {
    if (rod.tail > rod.first) forward(rod, solve);
    if (rod.tail > rod.first) is_bad = backward(rod) || is_bad;
  }
  if (is_bad) {
    reset(rod);
  } else {
    finish(rod);
  }
}

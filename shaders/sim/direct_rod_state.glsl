// State and geometry of the strands of direct_rod. Every quantity is per mass per length.
// A vertex that is groomed inside of a collider may stay there: a rod that is pushed out of its shape in every step,
// behind the back of its solve, is driven by that and whirls for good.
#define BEGINS_INSIDE 1
#include "sim/follow.glsl"

// Planes of one vertex per strand: position, velocity, displacement and velocity change as in step.glsl, with
// w of the velocity = tension of the edge that ends there, and for vertex 0 the length of the step before (0
// = none); w of the displacement = inertia that air adds in this substep (volume_forces.comp).
layout(binding = kUnitDisplacement) uniform samplerBuffer u_displacement;       // world, m
layout(binding = kUnitVelocityChange) uniform samplerBuffer u_velocity_change;  // world, m/s
// Joint tangent in the frame of the edge before (without twist: rest direction of the edge); w = length, m.
layout(binding = kUnitRodEdge) uniform samplerBuffer u_edge;
// Planes of one vector per strand: direction of the clamp, w = mean length of a free edge; its axis, w =
// length of the shortest edge with a direction;
// direction of a clamp at the tip, w = EI / (rho A) of the strand, m^4/s^2; axis of that clamp, w = GJ / (rho A).
// Head space.
layout(binding = kUnitRodStrand) uniform samplerBuffer u_strand;
layout(binding = kUnitRodAxis) uniform samplerBuffer u_axis;  // material axes, world; w = spin, rad
layout(std430, binding = kBindingDisplacement) writeonly restrict buffer DisplacementBlock {
  vec4 value[];
} b_displacement;
layout(std430, binding = kBindingVelocityChange) writeonly restrict buffer VelocityChangeBlock {
  vec4 value[];
} b_velocity_change;
layout(std430, binding = kBindingRodAxis) writeonly restrict buffer AxisBlock { vec4 value[]; } b_axis;
layout(std430, binding = kBindingRodScratch) restrict buffer RodScratchBlock { vec4 value[]; } b_scratch;

uniform float u_spin_inertia;     // of the section about the tangent, over its area, m^2
uniform float u_tip_length;       // of hair as heavy as the bead at the tip, m
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
  vec3 clamp_axis;
  vec3 clamp_turn;  // rad/s
#if HAS_PINNED_TAIL
  vec3 tail_direction;
  vec3 tail_axis;
#endif
  float mean_segment;
  float stiffness;  // EI / (rho A), m^4/s^2
  float twist_stiffness;
  float shortest;   // edges shorter at rest continue the one before
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
  float inertia;         // against all forces but those of air
};

uint element(Rod rod, uint vertex) { return vertex * rod.stride + rod.strand; }

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
  const vec4 displacement = texelFetch(u_displacement, int(at));
  node.displacement = displacement.xyz;
  node.inertia = 1.0 + displacement.w;
  node.velocity_change = texelFetch(u_velocity_change, int(at)).xyz;
  const vec3 relative = node.velocity - u_step.head_velocity.xyz;
  const lane_bool is_fast = dot(relative, relative) > u_step.style.w * u_step.style.w;
  if (is_any(is_fast)) {
    const vec3 limited = u_step.head_velocity.xyz + within_speed_limit(relative);
    node.velocity = select(is_fast, limited, node.velocity);
    node.displacement = select(is_fast, rod.history_h * limited, node.displacement);
    node.velocity_change = select(is_fast, vec3(0.0), node.velocity_change);
  }
  return node;
}

vec3 target_at(uint at) { return turned_with_head(texelFetch(u_rest, int(at)).xyz); }

// Direction of the edge that ends at `at`, of the given length at rest: the groomed one where it has none,
// that of the edge before where it has no length to speak of.
vec3 edge_direction(Rod rod, vec3 edge, uint at, float segment, vec3 before) {
  const float squared = dot(edge, edge);
  const lane_bool is_long = segment > rod.shortest;
  const lane_bool has_direction = is_long && squared > kTinySquared;
  const vec3 direction = edge * inversesqrt(squared);
  if (!is_any(!has_direction)) return direction;
  const vec3 groomed = normalize(target_at(at) - target_at(at - rod.stride));
  return select(has_direction, direction, select(is_long, groomed, before));
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

// Force on a vertex that moves as the iterate says, without the rod's own.
vec3 outer_force(Rod rod, Node node, vec3 rate) {
  const vec3 acceleration =
      (rod.now * (rate - node.velocity) - rod.before * node.velocity_change) * rod.inverse_h;
  const float drag = u_step.contact.y;
  return rod.force + drag * (gust_velocity(node.stored) - rate) - node.inertia * acceleration;
}


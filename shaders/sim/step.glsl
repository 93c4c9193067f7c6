// What a strand kernel reads: the step's uniform block (common/kernels/step_block.h) and the state of the
// strands. Element of vertex i of strand s: i * strand_count + s, so that neighbouring lanes are neighbouring
// strands.
#include "shared/limits.h"
#include "shared/bindings.h"
#include "lib/select.glsl"
#include "sim/bust.glsl"

layout(std140, binding = kBindingStep) uniform StepBlock {
  vec4 world_from_head[3];  // columns; w unused
  vec4 carry[3];            // columns: turn of the head during the substep
  vec4 head_velocity;       // m/s; w = substep, s
  vec4 push;                // velocity gained from gravity and mean wind, m/s; w = 1 / substep
  vec4 support;             // velocity gained from what carries the groom's weight, m/s; w = 1 / stiffness, s^2
  vec4 style;               // stiffness at the root 1/s^2, share at the tip, s_damping, speed limit m/s
  vec4 contact;             // friction, air drag 1/s, share of thrusts that is not kept, thickness spread
  uvec4 shape;              // strands, vertices of each, pinned at the root, first vertex of the pinned tail
  uint step_index;          // substeps since loading
  float follicle_cosine;    // of the most that a root leans from its groomed direction
  float follicle_sine;
  vec4 previous_turn[3];    // columns: velocity of a point by the head's turn in the step before, 1/s; w unused
  vec4 wind;                // mean wind relative to the head joint, m/s; w = time by which a pull looks ahead, s
  vec4 gust_amplitude[kMaxGustWaves];  // m/s; w = phase, rad
  vec4 gust_wave[kMaxGustWaves];       // rad/m
  vec4 collider[kMaxSphereColliders];    // centre, m; w = radius (0 = none)
  vec4 bust[4];             // turn of the chest, and before the substep; pivot, w = 1: it moves; share (sim/bust.glsl); head space
} u_step;

// Buffer textures: on llvmpipe a texel fetch costs half of a storage-block load or less. They show the
// buffers that the storage blocks write. Every vertex is fetched by one invocation only, before it stores a
// value computed from what it fetched, so the order cannot change.
layout(binding = kUnitRest) uniform samplerBuffer u_rest;           // head space, m; w = segment before it, m
layout(binding = kUnitPosition) uniform samplerBuffer u_position;   // head-relative world, m; w = arc, 0..1
layout(binding = kUnitVelocity) uniform samplerBuffer u_velocity;   // world, m/s; w = of the model

layout(std430, binding = kBindingPosition) writeonly restrict buffer PositionBlock {
  vec4 position[];
} b_position;
layout(std430, binding = kBindingVelocity) writeonly restrict buffer VelocityBlock {
  vec4 velocity[];
} b_velocity;

// A squared length below this has no direction.
const float kTinySquared = 1e-20;

// True for NaN, infinity and absurdly large numbers (2^40 and up). By bits: compilers may turn comparisons
// around, which changes what they say about NaN.
lane_bool is_broken(vec3 value) {
  const uvec3 magnitude = floatBitsToUint(value) & 0x7fffffffu;
  return max(max(magnitude.x, magnitude.y), magnitude.z) >= 0x53800000u;
}

vec3 turned_with_head(vec3 point) {
  return u_step.world_from_head[0].xyz * point.x + u_step.world_from_head[1].xyz * point.y +
         u_step.world_from_head[2].xyz * point.z;
}

vec3 in_head(vec3 point) {
  return vec3(dot(u_step.world_from_head[0].xyz, point), dot(u_step.world_from_head[1].xyz, point),
              dot(u_step.world_from_head[2].xyz, point));
}

vec3 carried_by_head(vec3 point) {
  return u_step.carry[0].xyz * point.x + u_step.carry[1].xyz * point.y + u_step.carry[2].xyz * point.z;
}

// Where a direction that goes with the head pointed before the substep.
vec3 before_the_turn(vec3 direction) {
  return vec3(dot(u_step.carry[0].xyz, direction), dot(u_step.carry[1].xyz, direction),
              dot(u_step.carry[2].xyz, direction));
}

// A place of the skin, in head space, where it was before the substep and is now; chest and neck have their own way.
vec3 moved_with_bust(vec3 before) {
  const vec3 pivot = u_step.bust[2].xyz;
  const vec4 turn = u_step.bust[0];
  const vec4 turn_before = u_step.bust[1];
  const float part = bust_part_at(before, turn_before, pivot, u_step.bust[3]);
  const vec3 rest = turned_by_part(before - pivot, part, -turn_before.xyz, turn_before.w);
  return pivot + turned_by_part(rest, part, turn.xyz, turn.w);
}

// What lies on the skin and goes along with it.
vec3 carried_by_skin(vec3 point) {
  vec3 carried = carried_by_head(point);
  if (u_step.bust[2].w > 0.0) carried = turned_with_head(moved_with_bust(in_head(carried)));
  return carried;
}

// A groomed place that goes along with the bust, turned with the head.
vec3 groomed_on_bust(vec3 groomed) {
  vec3 place = groomed;
  if (u_step.bust[2].w > 0.0) {
    const vec3 rest = in_head(groomed);
    const vec3 pivot = u_step.bust[2].xyz;
    const vec4 turn = u_step.bust[0];
    place = turned_with_head(pivot + turned_by_part(rest - pivot, bust_share(rest, u_step.bust[3]), turn.xyz, turn.w));
  }
  return place;
}

// The velocity, no longer than the speed limit.
vec3 within_speed_limit(vec3 velocity) {
  const float limit = u_step.style.w;
  const float squared = dot(velocity, velocity);
  return select(squared > limit * limit, velocity * (limit * inversesqrt(squared)), velocity);
}

void store_vertex(uint at, vec3 position, float arc) { b_position.position[at] = vec4(position, arc); }

// `velocity` is relative to the head joint.
void store_velocity(uint at, vec3 velocity) {
  b_velocity.velocity[at] = vec4(within_speed_limit(velocity) + u_step.head_velocity.xyz, 0.0);
}

// Where vertices are at the end of the substep, in cells, and which cells of the lattice hair is in, from and to
// along each axis, with the largest momentum of a sample. Each invocation looks at several strands.
#pragma variant HAS_WAY 0 1
#pragma variant HAS_SPLIT 0 1
#include "sim/step.glsl"
#include "volume/sample.glsl"

layout(local_size_x = kVolumeLocalSize) in;
layout(std430, binding = kBindingVolumeFacts) restrict buffer FactBlock { uint fact[]; } b_facts;
// (vertex_count x strand_count) in cells of the lattice, no number where nothing is known; w = the weight.
layout(std430, binding = kBindingVolumePlaces) writeonly restrict buffer PlaceBlock { vec4 place[]; } b_places;
// (vertex_count x strand_count) world, relative to the head joint, m/s.
layout(std430, binding = kBindingVolumeMotions) writeonly restrict buffer MotionBlock { vec4 motion[]; } b_motions;
// (vertex_count x strand_count) hair that a vertex stands for, or with split segments the part of the segment before it
// that each of its samples does; 0: not there.
layout(binding = kUnitVolumeLength) uniform samplerBuffer u_length;
#if HAS_WAY
layout(binding = kUnitDisplacement) uniform samplerBuffer u_displacement;  // in the last substep, m
#endif

uniform float u_per_cell;     // cells per metre
uniform float u_ahead;        // 1: where strands are at the end of the substep; 0: at its beginning
uniform uint u_sample_count;  // of a segment that is split

const uint kNoNumber = 0x7fc00000u;

vec3 low = vec3(float(kVolumeCellBias));
vec3 high = vec3(-float(kVolumeCellBias));

void widen(vec3 cells, float weight) {
  const bool is_there = is_sample(cells, weight);
  low = is_there ? min(low, cells) : low;
  high = is_there ? max(high, cells) : high;
}

void main() {
  float most = 0.0;
  const uint stride = gl_NumWorkGroups.x * kVolumeLocalSize;
  for (uint strand = gl_GlobalInvocationID.x; strand < u_step.shape.x; strand += stride) {
    vec3 cells_before = vec3(uintBitsToFloat(kNoNumber));
    vec3 speed_before = vec3(0.0);
    for (uint vertex = 0u; vertex < u_step.shape.y; ++vertex) {
      const uint at = vertex * u_step.shape.x + strand;
#if HAS_WAY
      const vec3 moved = texelFetch(u_displacement, int(at)).xyz * u_step.push.w;
#else
      const vec3 moved = texelFetch(u_velocity, int(at)).xyz;
#endif
      const vec3 velocity = moved - u_step.head_velocity.xyz;
      const vec3 point = texelFetch(u_position, int(at)).xyz + (u_ahead * u_step.head_velocity.w) * velocity;
      vec3 cells;
      for (int axis = 0; axis < 3; ++axis) {
        const vec3 row = u_step.world_from_head[axis].xyz;
        cells[axis] = ((row.z * point.z + row.y * point.y) + row.x * point.x) * u_per_cell;
      }
      const bool is_lost = is_broken(cells) || is_broken(velocity);
      cells = is_lost ? vec3(uintBitsToFloat(kNoNumber)) : cells;
      const vec3 speed = is_lost ? vec3(0.0) : abs(velocity);
      const float weight = texelFetch(u_length, int(at)).x;
      b_places.place[at] = vec4(cells, weight);
      b_motions.motion[at] = vec4(velocity, 0.0);
#if HAS_SPLIT
      // The others lie between these two.
      widen(between(cells_before, cells, sample_share(0u, u_sample_count)), weight);
      widen(between(cells_before, cells, sample_share(u_sample_count - 1u, u_sample_count)), weight);
      const vec3 fastest = max(speed_before, speed);
#else
      widen(cells, weight);
      const vec3 fastest = speed;
#endif
      most = max(most, weight * max(max(fastest.x, fastest.y), fastest.z));
      cells_before = cells;
      speed_before = speed;
    }
  }
  if (low.x > high.x) return;
  for (int axis = 0; axis < 3; ++axis) {
    atomicMin(b_facts.fact[kFactLow + uint(axis)], uint(int(floor(low[axis])) + int(kVolumeCellBias)));
    atomicMax(b_facts.fact[kFactHigh + uint(axis)], uint(int(floor(high[axis])) + int(kVolumeCellBias)));
  }
  // Numbers that are not negative are ordered as their bits are.
  atomicMax(b_facts.fact[kFactMostMomentum], floatBitsToUint(most));
}

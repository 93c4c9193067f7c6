// The samples of a hair volume: vertices, or places on segments that are longer than a cell, where they will be at the
// end of the substep. A row of invocations for each row of samples, an invocation for each strand.
#pragma variant HAS_WAY 0 1
#pragma variant HAS_SPLIT 0 1
#include "sim/step.glsl"
#include "volume/facts.glsl"

// (vertex_count x strand_count) hair that a vertex stands for, or with split segments the part of the segment before it
// that each of its samples does; 0: not there.
layout(binding = kUnitVolumeLength) uniform samplerBuffer u_length;
#if HAS_WAY
layout(binding = kUnitDisplacement) uniform samplerBuffer u_displacement;  // in the last substep, m
#endif

uniform float u_per_cell;     // cells per metre
uniform float u_ahead;        // 1: where strands are at the end of the substep; 0: at its beginning
uniform uint u_sample_count;  // of a segment that is split
uniform uint u_row_count;     // of samples

// `cells` in the lattice. Kernels must agree on the cell to the bit: nothing of it may be fused.
struct HairSample {
  vec3 cells;
  vec3 velocity;  // world, relative to the head joint
  float weight;   // length of hair, m
  bool is_there;
};

void find_vertex(uint at, out vec3 cells, out vec3 velocity) {
#if HAS_WAY
  const vec3 moved = texelFetch(u_displacement, int(at)).xyz * u_step.push.w;
#else
  const vec3 moved = texelFetch(u_velocity, int(at)).xyz;
#endif
  precise vec3 relative = moved - u_step.head_velocity.xyz;
  precise vec3 point = texelFetch(u_position, int(at)).xyz + (u_ahead * u_step.head_velocity.w) * relative;
  precise vec3 turned;
  for (int axis = 0; axis < 3; ++axis) {
    const vec3 row = u_step.world_from_head[axis].xyz;
    turned[axis] = ((row.z * point.z + row.y * point.y) + row.x * point.x) * u_per_cell;
  }
  cells = turned;
  velocity = relative;
}

HairSample hair_sample(uint strand, uint row) {
  HairSample found;
#if HAS_SPLIT
  const uint at = (row / u_sample_count + 1u) * u_step.shape.x + strand;
  vec3 before, now, velocity_before, velocity_now;
  find_vertex(at - u_step.shape.x, before, velocity_before);
  find_vertex(at, now, velocity_now);
  const float share = (float(row % u_sample_count) + 0.5) / float(u_sample_count);
  precise vec3 cells = before + (now - before) * share;
  found.cells = cells;
  found.velocity = velocity_before + (velocity_now - velocity_before) * share;
#else
  const uint at = row * u_step.shape.x + strand;
  find_vertex(at, found.cells, found.velocity);
#endif
  found.weight = texelFetch(u_length, int(at)).x;
  found.is_there = found.weight > 0.0 && !is_broken(found.cells) && !is_broken(found.velocity) &&
                   all(lessThan(abs(found.cells), vec3(float(kVolumeReach))));
  return found;
}

// The cell, from the grid's first.
ivec3 cell_of(HairSample found) { return ivec3(floor(found.cells)) - volume_first(); }
bool is_in_grid(ivec3 cell, uvec3 nodes) {
  return all(greaterThanEqual(cell, ivec3(0))) && all(lessThan(cell, ivec3(nodes) - 1));
}
uint index_of(ivec3 cell, uvec3 nodes) {
  return (uint(cell.z) * nodes.y + uint(cell.y)) * nodes.x + uint(cell.x);
}

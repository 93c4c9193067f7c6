// One slice of the halved lattice along each of several ways, away from a light: a cell's depth is that of the slice before
// it, looked up where the ray to the light crosses it, and half of both cells on the way. One invocation per cell and way.
#include "render/tile_frame.glsl"

layout(local_size_x = 32, local_size_y = 2) in;

layout(std430, binding = kBindingTileHalved) restrict readonly buffer Halved {
  float depth[];   // (half_size) across one cell
} b_halved;
layout(std430, binding = kBindingTileSwept) restrict buffer Swept {
  float depth[];   // (ways x half_size) from the light
} b_swept;

uniform mat4 u_ways;        // to the light, along the lattice's axes: the first four
uniform mat4 u_more_ways;
uniform int u_slice;        // counted from the light

ivec3 half_cell(int axis, int along, int u, int v) {
  return axis == 0 ? ivec3(along, u, v) : (axis == 1 ? ivec3(v, along, u) : ivec3(u, v, along));
}
int cell_index(ivec3 cell) { return (cell.z * u_frame.half_size.y + cell.y) * u_frame.half_size.x + cell.x; }

float behind(int axis, int along, ivec2 at, ivec2 size, float half_step, int first) {
  if (u_slice == 0 || any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, size))) return 0.0;
  int i = cell_index(half_cell(axis, along, at.x, at.y));
  return b_swept.depth[first + i] + half_step * b_halved.depth[i];
}

void main() {
  int way = int(gl_GlobalInvocationID.z);
  vec3 to_light = way < 4 ? u_ways[way].xyz : u_more_ways[way - 4].xyz;
  vec3 steepness = abs(to_light);
  int axis = steepness.x >= steepness.y && steepness.x >= steepness.z ? 0 : (steepness.y >= steepness.z ? 1 : 2);
  float steep = steepness[axis];
  ivec3 sizes = u_frame.half_size.xyz;
  ivec2 size = ivec2(sizes[(axis + 1) % 3], sizes[(axis + 2) % 3]);
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, size)) || u_slice >= sizes[axis] || steep == 0.0) return;
  int first = way * sizes.x * sizes.y * sizes.z;
  int direction = to_light[axis] > 0.0 ? -1 : 1;
  int along = to_light[axis] > 0.0 ? sizes[axis] - 1 - u_slice : u_slice;
  vec2 shift = vec2(to_light[(axis + 1) % 3], to_light[(axis + 2) % 3]) / steep;
  ivec2 whole = ivec2(floor(shift));
  vec2 part = shift - vec2(whole);
  float half_step = 0.5 * length(to_light) / steep;
  ivec2 from = at + whole;
  float near = mix(behind(axis, along - direction, from, size, half_step, first),
                   behind(axis, along - direction, from + ivec2(1, 0), size, half_step, first), part.x);
  float far = mix(behind(axis, along - direction, from + ivec2(0, 1), size, half_step, first),
                  behind(axis, along - direction, from + ivec2(1), size, half_step, first), part.x);
  int i = cell_index(half_cell(axis, along, at.x, at.y));
  b_swept.depth[first + i] = mix(near, far, part.y) + half_step * b_halved.depth[i];
}

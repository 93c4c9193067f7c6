// One slice of the halved lattice, away from a light: a cell's depth is that of the slice before it, looked up where the
// ray to the light crosses it, and half of both cells on the way. One invocation per cell of the slice.
#include "render/tile_frame.glsl"

layout(local_size_x = 32, local_size_y = 2) in;

layout(std430, binding = kBindingTileHalved) restrict readonly buffer Halved {
  float depth[];   // (half_size) across one cell
} b_halved;
layout(std430, binding = kBindingTileSwept) restrict buffer Swept {
  float depth[];   // (half_size) from the light
} b_swept;
layout(r32f, binding = kImageTileDepth) restrict writeonly uniform image3D u_depth;

uniform vec3 u_to_light;   // along the lattice's axes
uniform int u_axis;        // along which slices follow one another
uniform int u_slice;       // counted from the light

ivec3 half_cell(int along, int u, int v) {
  return u_axis == 0 ? ivec3(along, u, v) : (u_axis == 1 ? ivec3(v, along, u) : ivec3(u, v, along));
}

float behind(int along, ivec2 at, ivec2 size, float half_step) {
  if (u_slice == 0 || any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, size))) return 0.0;
  ivec3 cell = half_cell(along, at.x, at.y);
  int i = (cell.z * u_frame.half_size.y + cell.y) * u_frame.half_size.x + cell.x;
  return b_swept.depth[i] + half_step * b_halved.depth[i];
}

void main() {
  ivec3 sizes = u_frame.half_size.xyz;
  ivec2 size = ivec2(sizes[(u_axis + 1) % 3], sizes[(u_axis + 2) % 3]);
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, size))) return;
  int direction = u_to_light[u_axis] > 0.0 ? -1 : 1;
  int along = u_to_light[u_axis] > 0.0 ? sizes[u_axis] - 1 - u_slice : u_slice;
  float steep = abs(u_to_light[u_axis]);
  vec2 shift = vec2(u_to_light[(u_axis + 1) % 3], u_to_light[(u_axis + 2) % 3]) / steep;
  ivec2 whole = ivec2(floor(shift));
  vec2 part = shift - vec2(whole);
  float half_step = 0.5 * length(u_to_light) / steep;
  ivec2 from = at + whole;
  float near = mix(behind(along - direction, from, size, half_step), behind(along - direction, from + ivec2(1, 0), size, half_step), part.x);
  float far = mix(behind(along - direction, from + ivec2(0, 1), size, half_step), behind(along - direction, from + ivec2(1), size, half_step), part.x);
  ivec3 cell = half_cell(along, at.x, at.y);
  int i = (cell.z * sizes.y + cell.y) * sizes.x + cell.x;
  float depth = mix(near, far, part.y) + half_step * b_halved.depth[i];
  b_swept.depth[i] = depth;
  imageStore(u_depth, cell, vec4(depth));
}

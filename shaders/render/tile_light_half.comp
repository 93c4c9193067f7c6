// Optical depth across cells twice as wide: the sum of two in their length, the mean over four across. To each light the
// head is as opaque as the light says, from half a cell of it on.
#include "render/tile_frame.glsl"

layout(local_size_x = 32, local_size_y = 2) in;

layout(std430, binding = kBindingDensity) restrict readonly buffer LightSums {
  int cell[];   // (lattice_size) strands' optical depth and how far below the head's skin, as halves
} b_sums;
layout(std430, binding = kBindingTileHalved) restrict writeonly buffer Halved {
  float depth[];   // (half_size)
} b_halved;

uniform float u_solid_depth;   // of a cell inside the head
uniform vec2 u_solid_near;     // half solid so far below its skin; and all of it or nothing so far from there

void main() {
  ivec3 at = ivec3(gl_GlobalInvocationID);
  if (any(greaterThanEqual(at, u_frame.half_size.xyz))) return;
  ivec3 size = u_frame.lattice_size.xyz;
  vec2 sum = vec2(0.0);
  for (int i = 0; i < 8; ++i) {
    ivec3 corner = 2 * at + ivec3(i & 1, (i >> 1) & 1, i >> 2);
    vec2 here = unpackHalf2x16(uint(b_sums.cell[(corner.z * size.y + corner.y) * size.x + corner.x]));
    sum += vec2(here.x, clamp(0.5 + (0.5 / u_solid_near.y) * (here.y - u_solid_near.x), 0.0, 1.0));
  }
  b_halved.depth[(at.z * u_frame.half_size.y + at.y) * u_frame.half_size.x + at.x] =
      0.25 * sum.x + u_solid_depth * max(0.5 * sum.y - 2.0, 0.0);
}

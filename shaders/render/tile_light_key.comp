// A running sum away from the key light, and half of the cell itself; one invocation per line of cells. Leaves the depth of
// each cell where its sum was.
#include "render/tile_frame.glsl"

layout(local_size_x = 32, local_size_y = 2) in;

layout(std430, binding = kBindingDensity) restrict buffer LightSums {
  int cell[];   // (lattice_size) in steps of u_sum_unit; then the bits of optical depth
} b_sums;
layout(r32f, binding = kImageTileDepth) restrict writeonly uniform image3D u_depth;

uniform float u_sum_unit;
uniform float u_solid_depth;       // of a cell inside the head
uniform vec3 u_skull_middle;       // cells
uniform float u_skull_radius;      // cells; 0: there is none

void main() {
  ivec3 size = u_frame.lattice_size.xyz;
  ivec2 line = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(line, size.xy))) return;
  float passed = 0.0;
  int slice = size.x * size.y;
  int cell = line.y * size.x + line.x;
  for (int z = 0; z < size.z; ++z) {
    float here = float(b_sums.cell[cell]) * u_sum_unit;
    float outer = u_skull_radius > 0.0 ? u_skull_radius + 0.5 - distance(vec3(line, z), u_skull_middle) : 0.0;
    here += u_solid_depth * clamp(outer, 0.0, 1.0);
    imageStore(u_depth, ivec3(line, z), vec4(passed + 0.5 * here));
    b_sums.cell[cell] = floatBitsToInt(here);
    passed += here;
    cell += slice;
  }
}

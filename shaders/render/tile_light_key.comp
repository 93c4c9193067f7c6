// A running sum away from the key light, and half of the cell itself, and of the head the most that was passed; one
// invocation per line of cells. Leaves what lies in each cell where its sum was: strands' optical depth and how far below the
// head's skin it is, as halves.
#include "render/tile_frame.glsl"
#include "sim/bust.glsl"

layout(local_size_x = 32, local_size_y = 2) in;

layout(std430, binding = kBindingDensity) restrict buffer LightSums {
  int cell[];   // (lattice_size) in steps of u_sum_unit; then both halves
} b_sums;
layout(r32f, binding = kImageTileDepth) restrict writeonly uniform image3D u_depth;

uniform float u_sum_unit;
uniform float u_solid_depth;       // behind the head
uniform float u_soft_m;            // what the two ramps are given in
uniform vec2 u_solid_near;         // half solid so far below its skin; and all of it or nothing so far from there
uniform vec2 u_solid_far;          // the same for what lies this many cells behind it:
uniform int u_solid_far_cells;
layout(binding = kUnitTileSolid) uniform sampler3D u_solid;         // distance to the head's skin, negative inside
uniform float u_solid_reach_m;     // that 1 of it stands for
uniform int u_solid_border;        // cells along the lattice's sides that are none of it
uniform vec3 u_solid_origin_m;     // corner of its first cell, head space
uniform vec3 u_solid_from_m;       // 1 / (cells x cell size); 0: there is no head
uniform mat4 u_bust;               // turn of the chest; pivot, w = 1: it is turned; share of the rig (sim/bust.glsl)

// Above the skin by so much: nothing of the head.
const float kNoSolid = -4.0;

float solid_share(float below, vec2 ramp) { return clamp(0.5 + (0.5 / ramp.y) * (below - ramp.x), 0.0, 1.0); }

void main() {
  ivec3 size = u_frame.lattice_size.xyz;
  ivec2 line = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(line, size.xy))) return;
  float cell_m = u_frame.lattice_origin.w;
  vec3 along = u_frame.lattice_origin.xyz + cell_m * vec3(line, 0.0);
  vec3 place = along.x * u_frame.lattice_axis[0].xyz + along.y * u_frame.lattice_axis[1].xyz +
               along.z * u_frame.lattice_axis[2].xyz;
  vec3 solid = (place - u_solid_origin_m) * u_solid_from_m;
  vec3 solid_step = cell_m * u_frame.lattice_axis[2].xyz * u_solid_from_m;
  float passed = 0.0;
  float most_solid = 0.0;
  bool is_line = all(greaterThanEqual(line, ivec2(u_solid_border))) && all(lessThan(line, size.xy - u_solid_border));
  int slice = size.x * size.y;
  int cell = line.y * size.x + line.x;
  for (int z = 0; z < size.z; ++z) {
    float here = float(b_sums.cell[cell]) * u_sum_unit;
    vec3 at_rest = solid;
    if (u_bust[1].w > 0.0) {
      vec3 here_m = place + (cell_m * float(z)) * u_frame.lattice_axis[2].xyz;
      float part = bust_part_at(here_m, u_bust[0], u_bust[1].xyz, u_bust[2]);
      vec3 rest_m = u_bust[1].xyz + turned_by_part(here_m - u_bust[1].xyz, part, -u_bust[0].xyz, u_bust[0].w);
      at_rest = (rest_m - u_solid_origin_m) * u_solid_from_m;
    }
    // Outside of the head's box there is none.
    bool is_inside = is_line && z >= u_solid_border && z < size.z - u_solid_border && all(greaterThan(at_rest, vec3(0.0))) && all(lessThan(at_rest, vec3(1.0)));
    float below = is_inside ? u_solid_reach_m * textureLod(u_solid, at_rest, 0.0).r / -u_soft_m : kNoSolid;
    b_sums.cell[cell] = int(packHalf2x16(vec2(here, below)));
    most_solid = max(most_solid, solid_share(below, u_solid_near));
    if (z >= u_solid_far_cells)
      most_solid = max(most_solid, solid_share(unpackHalf2x16(uint(b_sums.cell[cell - u_solid_far_cells * slice])).y, u_solid_far));
    imageStore(u_depth, ivec3(line, z), vec4(passed + 0.5 * here + u_solid_depth * (most_solid * most_solid * most_solid)));
    passed += here;
    solid += solid_step;
    cell += slice;
  }
}

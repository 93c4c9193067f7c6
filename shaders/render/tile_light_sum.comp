// Drawn strands into the cells of the light lattice, one invocation per strand: integers, so that the order does not
// matter (common/render/light_lattice.h is the same on the CPU).
#include "render/tile_frame.glsl"
#include "render/tile_points.glsl"

layout(local_size_x = kStrandLocalSize) in;

layout(std430, binding = kBindingDensity) restrict buffer LightSums {
  int cell[];   // (lattice_size) in steps of 1 / u_sum_steps
} b_sums;

uniform float u_sum_per_m;     // of a strand's width, per metre, in steps
uniform int u_max_pieces;      // of one segment
uniform float u_pieces_per_m;

void add_to_cells(vec3 place, float amount) {
  ivec3 size = u_frame.lattice_size.xyz;
  if (!(all(greaterThanEqual(place, vec3(0.0))) && all(lessThan(place, vec3(size - 1))))) return;
  ivec3 low = ivec3(place);
  vec3 f = place - vec3(low);
  int cell = (low.z * size.y + low.y) * size.x + low.x;
  float y1 = amount * f.y;
  float y0 = amount - y1;
  vec4 corner = vec4(y0 - y0 * f.x, y0 * f.x, y1 - y1 * f.x, y1 * f.x);
  ivec4 far = ivec4(corner * f.z);
  ivec4 near = ivec4(corner - corner * f.z);
  int slice = size.x * size.y;
  atomicAdd(b_sums.cell[cell], near.x);
  atomicAdd(b_sums.cell[cell + 1], near.y);
  atomicAdd(b_sums.cell[cell + size.x], near.z);
  atomicAdd(b_sums.cell[cell + size.x + 1], near.w);
  cell += slice;
  atomicAdd(b_sums.cell[cell], far.x);
  atomicAdd(b_sums.cell[cell + 1], far.y);
  atomicAdd(b_sums.cell[cell + size.x], far.z);
  atomicAdd(b_sums.cell[cell + size.x + 1], far.w);
}

void main() {
  uint strand = gl_GlobalInvocationID.x;
  if (strand >= u_frame.strands.x) return;
  StrandNumbers numbers = strand_numbers(strand);
  uint first = first_point(strand);
  float along_step = 1.0 / float(max(numbers.point_count - 1u, 1u));
  // Somewhere within each segment, elsewhere for each strand: roots in a row leave no bands.
  float phase = unit_float(mix_u32(numbers.index));
  float fade = 1.0 / max(u_frame.strand.z, 1e-3);
  const float kFarM = 1e4;
  vec3 a = point_place(first);
  for (uint i = 1u; i < numbers.point_count; ++i) {
    vec3 b = point_place(first + i);
    vec3 way = b - a;
    float length_m = length(way);
    float along = (float(i) - 0.5) * along_step;
    float cover = min((1.0 - along) * fade + 0.1, 1.0);
    float amount = u_sum_per_m * length_m * cover * (1.0 + (u_frame.strand.y - 1.0) * along * along);
    int pieces = length_m < kFarM ? clamp(int(length_m * u_pieces_per_m), 1, u_max_pieces) : 0;
    float share = 1.0 / float(max(pieces, 1));
    for (int piece = 0; piece < pieces; ++piece)
      add_to_cells(lattice_cell(a + (float(piece) + phase) * share * way), amount * share);
    a = b;
  }
}

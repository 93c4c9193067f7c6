// Density of the drawn strands, one invocation per segment: what a segment hides of the light is spread over the eight
// cells round each piece of it, in integers, so that the order does not matter.
#include "shared/bindings.h"
#include "shared/limits.h"

layout(local_size_x = kStrandLocalSize) in;

struct ExpandedVertex {
  vec4 position_along;   // m, head space | 0 root .. 1 tip
  vec4 tangent_strand;   // unit | strand index as bits
};
layout(std430, binding = kBindingExpanded) restrict readonly buffer Expanded {
  ExpandedVertex vertex[];  // (segment_count x 2)
} expanded;
layout(std430, binding = kBindingDensity) restrict buffer Density {
  uint cell[];   // (cells^3) optical depth of a ray through the cell, in steps of 1 / u_density_steps
} density;

uniform uint u_segments;
uniform int u_cells;              // along each side
uniform vec3 u_cube_origin_m;
uniform float u_cell_m;
uniform vec3 u_to_light;
uniform float u_strand_width_m;   // at the root
uniform float u_tip_scale;
uniform float u_strand_opacity;
uniform float u_density_steps;

const int kMaxPieces = 32;

void main() {
  uint segment = gl_GlobalInvocationID.x;
  if (segment >= u_segments) return;
  vec4 a = expanded.vertex[2u * segment].position_along;
  vec4 b = expanded.vertex[2u * segment + 1u].position_along;
  vec3 way = b.xyz - a.xyz;
  float length_m = length(way);
  if (!(length_m < u_cell_m * float(u_cells))) return;
  int pieces = clamp(int(ceil(2.0 * length_m / u_cell_m)), 1, kMaxPieces);
  float along = 0.5 * (a.w + b.w);
  float width_m = u_strand_width_m * mix(1.0, u_tip_scale, along * along);
  // The area that it hides from the light, of the area of a cell.
  float hidden = length(cross(way, u_to_light)) * width_m / (u_cell_m * u_cell_m);
  float amount = u_strand_opacity * hidden * u_density_steps / float(pieces);
  for (int piece = 0; piece < pieces; ++piece) {
    vec3 point_m = mix(a.xyz, b.xyz, (float(piece) + 0.5) / float(pieces));
    vec3 cell = (point_m - u_cube_origin_m) / u_cell_m - 0.5;
    vec3 low = floor(cell);
    if (!(all(greaterThanEqual(low, vec3(0.0))) && all(lessThan(low, vec3(float(u_cells - 1)))))) continue;
    vec3 part = cell - low;
    ivec3 first = ivec3(low);
    for (int corner = 0; corner < 8; ++corner) {
      ivec3 offset = ivec3(corner & 1, (corner >> 1) & 1, corner >> 2);
      vec3 weight = mix(1.0 - part, part, vec3(offset));
      ivec3 at = first + offset;
      atomicAdd(density.cell[(at.z * u_cells + at.y) * u_cells + at.x],
                uint(amount * weight.x * weight.y * weight.z + 0.5));
    }
  }
}

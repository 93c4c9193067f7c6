// Hair as a volume: what each segment hides from the eye, its way and its place along the strand, summed in the cell that
// it lies in, in integers, so that the order does not matter. One invocation per segment.
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
layout(std430, binding = kBindingFarSum) restrict buffer FarSum {
  int sum[];   // (cells^3 x 4) way times depth, depth; (cells^3) along times depth; in steps of 1 / u_sum_steps
} far_sums;

uniform uint u_segments;
uniform int u_cells;              // along each side
uniform vec3 u_cube_origin_m;
uniform float u_cell_m;
uniform vec3 u_eye_m;
uniform float u_strand_width_m;   // at the root
uniform float u_tip_scale;
uniform float u_sum_steps;

const int kMaxPieces = 32;

void main() {
  uint segment = gl_GlobalInvocationID.x;
  if (segment >= u_segments) return;
  vec4 a = expanded.vertex[2u * segment].position_along;
  vec4 b = expanded.vertex[2u * segment + 1u].position_along;
  vec3 way = b.xyz - a.xyz;
  float length_m = length(way);
  if (!(length_m > 0.0 && length_m < u_cell_m * float(u_cells))) return;
  int pieces = clamp(int(ceil(length_m / u_cell_m)), 1, kMaxPieces);
  float along = 0.5 * (a.w + b.w);
  float width_m = u_strand_width_m * mix(1.0, u_tip_scale, along * along);
  vec3 to_eye = normalize(u_eye_m - 0.5 * (a.xyz + b.xyz));
  // The area that it hides from the eye, of the area of a cell.
  float hidden = length(cross(way, to_eye)) * width_m / (u_cell_m * u_cell_m);
  float amount = hidden * u_sum_steps / float(pieces);
  ivec4 sums = ivec4(round(amount * vec4(way / length_m, 1.0)));
  int along_sum = int(round(amount * along));
  for (int piece = 0; piece < pieces; ++piece) {
    vec3 point_m = mix(a.xyz, b.xyz, (float(piece) + 0.5) / float(pieces));
    vec3 at = (point_m - u_cube_origin_m) / u_cell_m;
    if (!(all(greaterThanEqual(at, vec3(0.0))) && all(lessThan(at, vec3(float(u_cells)))))) continue;
    ivec3 cell = ivec3(at);
    int index = (cell.z * u_cells + cell.y) * u_cells + cell.x;
    atomicAdd(far_sums.sum[4 * index], sums.x);
    atomicAdd(far_sums.sum[4 * index + 1], sums.y);
    atomicAdd(far_sums.sum[4 * index + 2], sums.z);
    atomicAdd(far_sums.sum[4 * index + 3], sums.w);
    atomicAdd(far_sums.sum[4 * u_cells * u_cells * u_cells + index], along_sum);
  }
}

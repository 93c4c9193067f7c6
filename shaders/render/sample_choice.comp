// Samples by density (Woodhouse 2017, 5.2): marks segments with so much hair behind them that nothing shines through. For
// those one sample per pixel will do. One invocation per segment.
#include "shared/bindings.h"
#include "shared/limits.h"

layout(local_size_x = kStrandLocalSize) in;

struct ExpandedVertex {
  vec4 position_along;
  uvec4 tangent_strand;   // unit, as bits | strand index, its highest bit the mark
};
layout(std430, binding = kBindingExpanded) restrict buffer Expanded {
  ExpandedVertex vertex[];  // (segment_count x 2)
} expanded;

uniform uint u_segments;
uniform vec3 u_eye_m;
uniform sampler3D u_density;
uniform vec3 u_cube_origin_m;
uniform float u_cube_from_m;      // 1 / its side
uniform float u_density_per_m;
uniform float u_deep_depth;       // optical depth from which a segment is deep

const int kSteps = 12;

void main() {
  uint segment = gl_GlobalInvocationID.x;
  if (segment >= u_segments) return;
  vec3 from_m = expanded.vertex[2u * segment].position_along.xyz;
  vec3 away = from_m - u_eye_m;
  float distance_m = length(away);
  vec3 from = (from_m - u_cube_origin_m) * u_cube_from_m;
  vec3 way = distance_m > 0.0 ? away / distance_m * u_cube_from_m : vec3(u_cube_from_m);
  vec3 steep = mix(vec3(1e-6), abs(way), greaterThan(abs(way), vec3(1e-6)));
  vec3 room = mix(from, 1.0 - from, greaterThan(way, vec3(0.0))) / steep;
  float length_m = max(min(min(room.x, room.y), room.z), 0.0);
  float sum = 0.0;
  for (int i = 0; i < kSteps; ++i)
    sum += texture(u_density, from + (float(i) + 0.5) * (length_m / float(kSteps)) * way).r;
  if (!(sum * u_density_per_m * length_m / float(kSteps) > u_deep_depth)) return;
  expanded.vertex[2u * segment].tangent_strand.w |= 0x80000000u;
  expanded.vertex[2u * segment + 1u].tangent_strand.w |= 0x80000000u;
}

// Expansion by need: of each gap of a strand as many segments as keep their chords within u_tolerance_px of the curve.
// One invocation per gap; first it counts, then, where the gap's segments begin in the buffer is known, it writes them.
#pragma variant IS_COUNTING 0 1
#include "render/strand_curves.glsl"
#include "shared/limits.h"

layout(local_size_x = kStrandLocalSize) in;

layout(std430, binding = kBindingRunningSum) restrict buffer RunningSum {
  uint sum[];    // counts of gaps, then of all before a gap
} running;
struct ExpandedVertex {
  vec4 position_along;   // m, head space | 0 root .. 1 tip
  vec4 tangent_strand;   // unit | strand index as bits
};
#if IS_COUNTING == 0
layout(std430, binding = kBindingExpanded) restrict writeonly buffer Expanded {
  ExpandedVertex vertex[];  // (segment_count x 2)
} expanded;
#endif

uniform uint u_first_strand;
uniform uint u_strands;
uniform uint u_segments;         // per gap at most
#if IS_COUNTING == 1
uniform float u_tolerance_px;
uniform mat4 u_clip_from_head;
uniform float u_focal_px;
uniform float u_near_m;

// The chord of one of n equal parts of a curve strays from it by at most |p''| / (8 n^2). Three second differences know
// the p'' of a cubic, which is linear, exactly; of a follower, which has waves of its own, about.
uint needed(uint strand, uint gap) {
  vec3 p[5];
  for (int i = 0; i < 5; ++i) p[i] = strand_point(strand, gap, 0.25 * float(i)).position_m;
  vec3 early = 16.0 * (p[0] - 2.0 * p[1] + p[2]);
  vec3 middle = 16.0 * (p[1] - 2.0 * p[2] + p[3]);
  vec3 late = 16.0 * (p[2] - 2.0 * p[3] + p[4]);
  float bend_m = max(max(length(1.5 * early - 0.5 * late), length(1.5 * late - 0.5 * early)), length(middle));
  float distance_m = max((u_clip_from_head * vec4(p[2], 1.0)).w, u_near_m);
  float parts = ceil(sqrt(bend_m * u_focal_px / distance_m / (8.0 * u_tolerance_px)));
  return parts >= 1.0 ? min(uint(min(parts, 64.0)), u_segments) : 1u;
}
#else
void write(uint at, uint strand, uint gap, float t) {
  CurvePoint curve = strand_point(strand, gap, t);
  float along = (float(gap) + t) / float(u_vertex_count - 1u);
  vec3 tangent = unit_or(curve.derivative, vec3(0.0, -1.0, 0.0));
  expanded.vertex[at] = ExpandedVertex(vec4(curve.position_m, along), vec4(tangent, uintBitsToFloat(strand)));
}
#endif

void main() {
  uint index = gl_GlobalInvocationID.x;
  uint gaps = u_vertex_count - 1u;
  if (index >= u_strands * gaps) return;
  uint strand = u_first_strand + index / gaps;
  uint gap = index % gaps;
#if IS_COUNTING == 1
  running.sum[index] = needed(strand, gap);
#else
  uint begin = running.sum[index];
  uint parts = running.sum[index + 1u] - begin;
  for (uint part = 0u; part < parts; ++part) {
    write(2u * (begin + part), strand, gap, float(part) / float(parts));
    write(2u * (begin + part) + 1u, strand, gap, float(part + 1u) / float(parts));
  }
#endif
}

// Culling: which segments can be seen, 32 of them per invocation, as bits and their count. A segment is left out only
// where no pixel of its quad could be drawn: both ends beyond the same side of the picture, or behind what is opaque in
// all blocks that it touches. Positions that are not numbers are kept.
#pragma variant HAS_OCCLUSION 0 1
#include "shared/bindings.h"
#include "shared/limits.h"

layout(local_size_x = kStrandLocalSize) in;

struct ExpandedVertex {
  vec4 position_along;   // m, head space | 0 root .. 1 tip
  vec4 tangent_strand;
};
layout(std430, binding = kBindingExpanded) restrict readonly buffer Expanded {
  ExpandedVertex vertex[];  // (segment_count x 2)
} expanded;
layout(std430, binding = kBindingCullMask) restrict writeonly buffer CullMask {
  uint bits[];   // of 32 segments
} mask;
layout(std430, binding = kBindingRunningSum) restrict writeonly buffer RunningSum {
  uint count[];
} running;

uniform uint u_segments;
uniform mat4 u_clip_from_head;
uniform vec2 u_target_px;
uniform float u_focal_px;         // pixels per metre at 1 m distance
uniform float u_strand_width_m;   // at the root, where it is widest
uniform float u_near_m;

#if HAS_OCCLUSION == 1
layout(std430, binding = kBindingCullDepth) restrict readonly buffer CullDepth {
  float block[];
} farthest;
uniform int u_blocks_across;
uniform int u_blocks_down;
const int kMaxBlocksAcross = 4;   // of a segment that is asked for

bool is_hidden(vec2 low_px, vec2 high_px, float depth) {
  ivec2 end = ivec2(u_blocks_across, u_blocks_down) - 1;
  ivec2 low = clamp(ivec2(floor(low_px / float(kCullBlock))), ivec2(0), end);
  ivec2 high = clamp(ivec2(floor(high_px / float(kCullBlock))), ivec2(0), end);
  if (any(greaterThanEqual(high - low, ivec2(kMaxBlocksAcross)))) return false;
  for (int y = low.y; y <= high.y; ++y)
    for (int x = low.x; x <= high.x; ++x)
      if (!(depth > farthest.block[y * u_blocks_across + x])) return false;
  return true;
}
#endif

bool is_seen(uint segment) {
  vec4 a = u_clip_from_head * vec4(expanded.vertex[2u * segment].position_along.xyz, 1.0);
  vec4 b = u_clip_from_head * vec4(expanded.vertex[2u * segment + 1u].position_along.xyz, 1.0);
  if (a.w < u_near_m && b.w < u_near_m) return false;
  // What crosses the eye's plane lands anywhere.
  if (!(a.w >= u_near_m && b.w >= u_near_m)) return true;
  // Half of the quad's width, and a pixel for what the rasteriser rounds.
  float near_w = min(a.w, b.w);
  float reach_px = 0.5 * (u_strand_width_m * u_focal_px / near_w + 1.0) + 1.0;
  vec2 a_px = (a.xy / a.w * 0.5 + 0.5) * u_target_px;
  vec2 b_px = (b.xy / b.w * 0.5 + 0.5) * u_target_px;
  vec2 low_px = min(a_px, b_px) - reach_px;
  vec2 high_px = max(a_px, b_px) + reach_px;
  if (any(lessThan(high_px, vec2(0.0))) || any(greaterThan(low_px, u_target_px))) return false;
#if HAS_OCCLUSION == 1
  // A step of depth beyond rounding.
  float depth = 0.5 * min(a.z / a.w, b.z / b.w) + 0.5 - 1e-6;
  if (is_hidden(low_px, high_px, depth)) return false;
#endif
  return true;
}

void main() {
  uint block = gl_GlobalInvocationID.x;
  uint first = 32u * block;
  if (first >= u_segments) return;
  uint bits = 0u;
  uint count = min(32u, u_segments - first);
  for (uint i = 0u; i < count; ++i)
    if (is_seen(first + i)) bits |= 1u << i;
  mask.bits[block] = bits;
  running.count[block] = uint(bitCount(bits));
}

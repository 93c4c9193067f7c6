// Strand pass: one quad per expanded segment, facing the camera, one pixel wider than the strand so that coverage
// fades out inside it. Four invocations per segment pull its two ends from the expanded buffer. Shaded here, unless the
// look wants it per fragment: a strand is thinner than a pixel and its vertices are close.
#pragma variant IS_PER_FRAGMENT 0 1
#pragma variant JOINTS 0 1
#pragma variant IS_CHOSEN 0 1
#include "lib/hash.glsl"
#include "render/strand_light.glsl"
#include "shared/bindings.h"

struct ExpandedVertex {
  vec4 position_along;   // m, head space | 0 root .. 1 tip
  vec4 tangent_strand;   // unit | strand index as bits
};
layout(std430, binding = kBindingExpanded) restrict readonly buffer Expanded {
  ExpandedVertex vertex[];  // (segment_count x 2)
} expanded;
#if IS_CHOSEN == 1
layout(std430, binding = kBindingChosen) restrict readonly buffer Chosen {
  uint segment[];  // those that are drawn
} chosen;
#endif

uniform mat4 u_clip_from_head;
uniform vec2 u_target_px;
uniform float u_focal_px;         // pixels per metre at 1 m distance
uniform float u_strand_width_m;   // at the root
uniform float u_tip_scale;
uniform float u_near_m;
uniform float u_widened_px;       // so that coverage fades out within the quad; 0: samples tell the edge
uniform int u_which;              // of all segments

const int kShallow = 1;
const int kDeep = 2;

noperspective out float v_across_px;   // from the strand's centre line
noperspective out float v_width_px;
flat out float v_threshold;            // of this strand
#if IS_PER_FRAGMENT == 1
out vec3 v_position_m;                 // on the centre line, head space
out vec3 v_tangent;
out float v_along;
flat out uint v_strand;
#else
out vec3 v_color;
#endif

const uint kSaltThreshold = 0x7f4a7c15u;

#if JOINTS == 1
// Where the camera looks, unit, head space.
vec3 front() {
  return normalize(vec3(u_clip_from_head[0].w, u_clip_from_head[1].w, u_clip_from_head[2].w));
}
#endif

void main() {
#if IS_CHOSEN == 1
  uint segment = chosen.segment[uint(gl_VertexID) >> 2];
#else
  uint segment = uint(gl_VertexID) >> 2;
#endif
  uint end = uint(gl_VertexID >> 1) & 1u;
  float side = float(gl_VertexID & 1) * 2.0 - 1.0;
  ExpandedVertex v = expanded.vertex[2u * segment + end];
  vec3 position_m = v.position_along.xyz;
  vec3 tangent = v.tangent_strand.xyz;
  uint strand = floatBitsToUint(v.tangent_strand.w);
  uint is_deep = strand >> 31;   // of sample_choice.comp
  strand &= 0x7fffffffu;
  if (u_which == kShallow && is_deep == 1u || u_which == kDeep && is_deep == 0u) {
    gl_Position = vec4(0.0, 0.0, 2.0, 1.0);   // all corners in one place, and that not seen
    return;
  }
  float along = v.position_along.w;

  vec4 clip = u_clip_from_head * vec4(position_m, 1.0);
#if JOINTS == 1
  // Woodhouse 2017, 4.3.2: across the segment's own way and the camera's, so quads have gaps at bends.
  vec3 way = expanded.vertex[2u * segment + 1u].position_along.xyz - expanded.vertex[2u * segment].position_along.xyz;
  vec4 clip_step = u_clip_from_head * vec4(way - front() * dot(way, front()), 0.0);
#else
  vec4 clip_step = u_clip_from_head * vec4(tangent, 0.0);
#endif
  // Direction on the screen, up to a positive factor. A strand that points at the eye has none: any will do.
  vec2 direction = (clip_step.xy * clip.w - clip.xy * clip_step.w) * u_target_px;
  float direction_length = length(direction);
  vec2 across = direction_length > 1e-12 ? vec2(-direction.y, direction.x) / direction_length : vec2(1.0, 0.0);

  float distance_m = max(clip.w, u_near_m);
  v_width_px = u_strand_width_m * mix(1.0, u_tip_scale, along * along) * u_focal_px / distance_m;
  v_across_px = side * 0.5 * max(v_width_px + u_widened_px, 1.0);
  clip.xy += across * v_across_px * (2.0 / u_target_px) * distance_m;
  gl_Position = clip;
  v_threshold = unit_float(mix_u32(strand ^ kSaltThreshold));
#if IS_PER_FRAGMENT == 1
  v_position_m = position_m;
  v_tangent = tangent;
  v_along = along;
  v_strand = strand;
#else
  v_color = strand_light(position_m, tangent, strand, along);
#endif
}

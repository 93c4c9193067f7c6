// Strands as the light sees them: a quad per expanded segment across the light, a texel wider than the strand so that
// coverage fades out inside it. The light is parallel.
#include "shared/bindings.h"

struct ExpandedVertex {
  vec4 position_along;   // m, head space | 0 root .. 1 tip
  vec4 tangent_strand;   // unit | strand index as bits
};
layout(std430, binding = kBindingExpanded) restrict readonly buffer Expanded {
  ExpandedVertex vertex[];  // (segment_count x 2)
} expanded;

uniform mat4 u_map_from_head;     // texels, and metres along the light
uniform int u_map_texels;         // along each side
uniform float u_texels_per_m;
uniform float u_depth_m;          // of the hair
uniform float u_strand_width_m;   // at the root
uniform float u_tip_scale;

noperspective out float v_across_px;   // texels from the strand's centre line
noperspective out float v_width_px;
noperspective out float v_depth_m;

void main() {
  uint segment = uint(gl_VertexID) >> 2;
  uint end = uint(gl_VertexID >> 1) & 1u;
  float side = float(gl_VertexID & 1) * 2.0 - 1.0;
  ExpandedVertex v = expanded.vertex[2u * segment + end];
  float along = v.position_along.w;
  vec3 at = (u_map_from_head * vec4(v.position_along.xyz, 1.0)).xyz;
  vec2 direction = (u_map_from_head * vec4(v.tangent_strand.xyz, 0.0)).xy;
  float direction_length = length(direction);
  vec2 across = direction_length > 1e-9 ? vec2(-direction.y, direction.x) / direction_length : vec2(1.0, 0.0);
  v_width_px = u_strand_width_m * mix(1.0, u_tip_scale, along * along) * u_texels_per_m;
  v_across_px = side * 0.5 * (v_width_px + 1.0);
  v_depth_m = at.z;
  // What strays out of the hair's depth is kept at its ends.
  float depth = clamp(at.z / u_depth_m, 0.0, 1.0);
  gl_Position = vec4(2.0 * (at.xy + across * v_across_px) / float(u_map_texels) - 1.0, 2.0 * depth - 1.0, 1.0);
}

// Strand pass: coverage decides by a fixed pattern which samples a strand takes, so that neither order nor blending
// matters and the same input gives the same pixels.
#pragma variant IS_PER_FRAGMENT 0 1
#include "lib/coverage.glsl"
#include "render/strand_light.glsl"

noperspective in float v_across_px;
noperspective in float v_width_px;
flat in float v_threshold;
#if IS_PER_FRAGMENT == 1
in vec3 v_position_m;
in vec3 v_tangent;
in float v_along;
flat in uint v_strand;
#else
in vec3 v_color;
#endif

uniform float u_shown;   // share of the pixels, 2 x 2 samples each, that show strands

layout(location = 0) out vec4 out_color;

void main() {
  if (u_shown < 1.0 && !shows_strands(0.5 * gl_FragCoord.xy, u_shown)) discard;
  if (line_coverage(v_width_px, v_across_px) <= coverage_threshold(gl_FragCoord.xy, v_threshold)) discard;
#if IS_PER_FRAGMENT == 1
  vec3 color = strand_light(v_position_m, v_tangent / max(length(v_tangent), 1e-6), v_strand, v_along);
#else
  vec3 color = v_color;
#endif
  out_color = vec4(color, 1.0);
}

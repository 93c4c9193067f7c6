// Strand pass: coverage decides by a fixed pattern which samples a strand takes, so that neither order nor blending
// matters and the same input gives the same pixels.
#include "lib/coverage.glsl"

noperspective in float v_across_px;
noperspective in float v_width_px;
flat in float v_threshold;
in vec3 v_color;

layout(location = 0) out vec4 out_color;

void main() {
  if (line_coverage(v_width_px, v_across_px) <= coverage_threshold(gl_FragCoord.xy, v_threshold)) discard;
  out_color = vec4(v_color, 1.0);
}

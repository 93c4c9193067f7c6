// Strand pass with the rasteriser's samples at the edges: strands thinner than a pixel are drawn a pixel wide, into that
// share of the samples.
#include "lib/coverage.glsl"

noperspective in float v_width_px;
flat in float v_threshold;
in vec3 v_color;

layout(location = 0) out vec4 out_color;

const int kMultisamples = 4;

void main() {
  float threshold = coverage_threshold(gl_FragCoord.xy, v_threshold);
  int mask = 0;
  for (int i = 0; i < kMultisamples; ++i)
    if (min(v_width_px, 1.0) > fract(threshold + float(i) / float(kMultisamples))) mask |= 1 << i;
  if (mask == 0) discard;
  gl_SampleMask[0] = mask;
  out_color = vec4(v_color, 1.0);
}

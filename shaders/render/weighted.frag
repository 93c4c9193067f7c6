// Weighted blending (McGuire and Bavoil 2013, equation 10 in the form with the depth of the window): the mean colour of
// all fragments of a pixel, with weights that fall with depth, and the opacity of all.
#include "render/blended.glsl"

layout(location = 0) out vec4 out_sum;        // weight times opacity times colour, and weight times opacity
layout(location = 1) out float out_passing;   // multiplied

const float kLeastWeight = 1e-2;
const float kMostWeight = 3e2;   // a hundred opaque layers stay within half floats

void main() {
  float opacity = strand_opacity();
  if (opacity < kLeastOpacity) discard;
  float opaque = min(1.0, opacity) * 8.0 + 0.01;
  float near = 1.0 - 0.95 * gl_FragCoord.z;
  float weight = clamp(opaque * opaque * opaque * 1e8 * near * near * near, kLeastWeight, kMostWeight);
  out_sum = weight * opacity * vec4(v_color, 1.0);
  out_passing = 1.0 - opacity;
}

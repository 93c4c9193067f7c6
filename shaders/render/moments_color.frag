// Moments, second part: every fragment adds its colour with the share of it that passes what lies in front.
#include "lib/moments.glsl"
#include "render/blended.glsl"
#include "render/moments_depth.glsl"

uniform sampler2D u_moments;
uniform sampler2D u_absorbance;

layout(location = 0) out vec4 out_sum;   // transmittance times opacity times colour, and times opacity

void main() {
  float opacity = strand_opacity();
  if (opacity < kLeastOpacity) discard;
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  float b0 = texelFetch(u_absorbance, pixel, 0).r;
  float passing = 1.0;
  if (b0 > kLeastAbsorbance)
    passing = transmittance_at(moment_depth(1.0 / gl_FragCoord.w), b0, texelFetch(u_moments, pixel, 0),
                               kOverestimation);
  out_sum = passing * opacity * vec4(v_color, 1.0);
}

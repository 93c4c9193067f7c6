// Moments, first part: absorbance and its first four moments of depth, added up.
#include "lib/moments.glsl"
#include "render/blended.glsl"
#include "render/moments_depth.glsl"

layout(location = 0) out vec4 out_moments;
layout(location = 1) out float out_absorbance;

void main() {
  float opacity = strand_opacity();
  if (opacity < kLeastOpacity) discard;
  float z = moment_depth(1.0 / gl_FragCoord.w);
  float a = absorbance(opacity);
  float z2 = z * z;
  out_moments = a * vec4(z, z2, z2 * z, z2 * z2);
  out_absorbance = a;
}

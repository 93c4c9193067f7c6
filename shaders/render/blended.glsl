// What fragments of strands have in common that are blended in a layer of their own: the part of a pixel that a strand
// covers is its opacity. One invocation per pixel, not per sample of the scene.
#include "lib/coverage.glsl"

noperspective in float v_across_px;
noperspective in float v_width_px;
in vec3 v_color;

uniform sampler2D u_scene_depth;   // of what is opaque, 2 x 2 samples per pixel
uniform vec2 u_pixel_step;         // 1 / pixels of the target

// Below this nothing is seen of a strand, nor of many: opacities are stored in 11 bits.
const float kLeastOpacity = 1.0 / 2048.0;

// In front of how many of the scene's samples in its pixel the fragment lies counts as coverage.
float strand_opacity() {
  float coverage = line_coverage(v_width_px, v_across_px);
  if (coverage < kLeastOpacity) return 0.0;
  // The middle of a pixel is the corner between its four samples.
  vec4 depth = textureGather(u_scene_depth, gl_FragCoord.xy * u_pixel_step);
  return coverage * dot(vec4(lessThan(vec4(gl_FragCoord.z), depth)), vec4(0.25));
}

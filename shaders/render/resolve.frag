// Resolve pass: the mean of a pixel's samples over the background, as sRGB. Row 0 of the target is the top of the
// picture, so that it is read back without turning it over.
#pragma variant HAS_LAYER 0 1
#pragma variant IS_MULTISAMPLED 0 1
#pragma variant HAS_BACKDROP 0 1
#include "shared/backdrop.h"
#include "lib/tone.glsl"

#if IS_MULTISAMPLED == 1
uniform sampler2DMS u_scene;   // of the target's size, kMultisamples each
const int kMultisamples = 4;
#else
uniform sampler2D u_scene;     // (samples per pixel side) times larger than the target; alpha 1 = drawn
#endif
uniform sampler2D u_layer;     // of the target's size: what lies over the scene, colour times opacity and opacity
uniform int u_samples;         // per pixel side
uniform int u_target_height;
#if HAS_BACKDROP == 1
layout(binding = kUnitBackdrop) uniform sampler2D u_backdrop;  // sRGB, of the target's size and rows
#else
uniform vec3 u_background;     // linear, at middle height
#endif

layout(location = 0) out vec4 out_color;

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  ivec2 from_bottom = ivec2(pixel.x, u_target_height - 1 - pixel.y);
  vec4 sum = vec4(0.0);
#if IS_MULTISAMPLED == 1
  for (int i = 0; i < kMultisamples; ++i) sum += texelFetch(u_scene, from_bottom, i);
  float share = 1.0 / float(kMultisamples);
#else
  for (int y = 0; y < u_samples; ++y)
    for (int x = 0; x < u_samples; ++x) sum += texelFetch(u_scene, from_bottom * u_samples + ivec2(x, y), 0);
  float share = 1.0 / float(u_samples * u_samples);
#endif
#if HAS_LAYER == 1
  vec4 layer = texelFetch(u_layer, from_bottom, 0);
  sum = layer / share + (1.0 - layer.a) * sum;
#endif
  float drawn = sum.a * share;
  vec3 scene = drawn > 0.0 ? tone_map(sum.rgb / sum.a) : vec3(0.0);
#if HAS_BACKDROP == 1
  vec3 behind = linear_from_srgb(texelFetch(u_backdrop, pixel, 0).rgb);
#else
  vec3 behind = background_light(u_background, (float(from_bottom.y) + 0.5) / float(u_target_height));
#endif
  out_color = vec4(srgb_from_linear(mix(behind, scene, drawn)), 1.0);
}

// Hair over what a page has drawn: tone curve, and sRGB where a screen shows it.
#include "lib/tone.glsl"

uniform sampler2D u_scene;   // light times how much of a pixel is drawn, and that
uniform bool u_is_screen;

layout(location = 0) out vec4 out_color;

void main() {
  vec4 scene = texelFetch(u_scene, ivec2(gl_FragCoord.xy), 0);
  vec3 color = tone_map(scene.rgb / max(scene.a, 1e-5));
  if (u_is_screen) color = srgb_from_linear(clamp(color, 0.0, 1.0));
  out_color = vec4(color * scene.a, scene.a);
}

// Strands and head over the background, tone curve, sRGB.
#include "lib/tone.glsl"

uniform sampler2D u_scene;       // light times how much of a pixel is drawn, and that
uniform float u_height_px;
uniform vec3 u_background;       // linear, at middle height

layout(location = 0) out vec4 out_color;

void main() {
  vec4 scene = texelFetch(u_scene, ivec2(gl_FragCoord.xy), 0);
  float height = gl_FragCoord.y / u_height_px;
  vec3 color = mix(background_light(u_background, height), tone_map(scene.rgb / max(scene.a, 1e-5)), scene.a);
  out_color = vec4(srgb_from_linear(clamp(color, 0.0, 1.0)), 1.0);
}

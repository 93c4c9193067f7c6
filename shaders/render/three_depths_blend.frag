// Three depths, last part: what the three nearest leave of the opacity of all takes the mean colour of the others.
#include "lib/opacity_sum.glsl"
#include "render/three_depths.glsl"

uniform sampler2D u_near;
uniform sampler2D u_far;

layout(location = 0) out vec4 out_layer;

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 near = texelFetch(u_near, pixel, 0);
  vec4 far = texelFetch(u_far, pixel, 0);
  float opacity = 1.0 - transmitted(keys.pixel[pixel_index()].w);
  float rest = max(opacity - near.a, 0.0);
  vec3 color = near.rgb;
  if (far.a > 0.0) color += rest * far.rgb / far.a;
  out_layer = vec4(color, opacity);
}

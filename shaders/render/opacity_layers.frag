// Deep opacity map, second draw: a strand adds itself to its own layer and to all behind it (Yuksel and Keyser 2008, 3.1);
// what lies behind the last layer counts to it. Where the layers begin goes into the fourth channel, as the greatest.
#include "render/shadow_map.glsl"

uniform sampler2D u_first_depth;
uniform float u_depth_m;
uniform vec3 u_layer_ends_m;

layout(location = 0) out vec4 out_layers;

void main() {
  float depth = added_depth();
  if (depth <= 0.0) discard;
  float first_m = texelFetch(u_first_depth, ivec2(gl_FragCoord.xy), 0).r * u_depth_m;
  float behind_m = v_depth_m - first_m;
  out_layers = vec4(depth * vec3(behind_m < u_layer_ends_m.x, behind_m < u_layer_ends_m.y, true), first_m);
}

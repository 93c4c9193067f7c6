// A strand in a pixel: its exact coverage, over what lies behind it.
#include "lib/coverage.glsl"

in float v_across_px;
in vec4 v_light;
in vec3 v_line;   // width, direction

layout(location = 0) out vec4 out_color;

void main() {
  vec2 direction = v_line.yz * inversesqrt(max(dot(v_line.yz, v_line.yz), 1e-12));
  LineFilter line = line_filter(max(v_line.x, 1e-4), direction);
  float cover = min(max(min(line.base - line.slope * abs(v_across_px), line.peak), 0.0), 1.0);
  float opacity = cover * v_light.a;
  out_color = vec4(v_light.rgb * opacity, opacity);
}

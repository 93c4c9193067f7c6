// A strand in a pixel: its coverage (shaders/lib/coverage.glsl), over what lies behind it.

in float v_across_px;
in vec4 v_light;
in vec3 v_line;   // base, slope, peak of a LineFilter

layout(location = 0) out vec4 out_color;

void main() {
  float cover = clamp(min(v_line.x - v_line.y * abs(v_across_px), v_line.z), 0.0, 1.0);
  float opacity = cover * v_light.a;
  out_color = vec4(v_light.rgb * opacity, opacity);
}

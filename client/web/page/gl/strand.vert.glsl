// Corners of segments, as points.vert.glsl left them.
layout(location = 0) in vec4 in_place;
layout(location = 1) in vec4 in_light;
layout(location = 2) in vec4 in_line;

out float v_across_px;
out vec4 v_light;
out vec3 v_line;

void main() {
  gl_Position = vec4(in_place.xyz, 1.0);
  v_across_px = in_place.w;
  v_light = in_light;
  v_line = in_line.xyz;
}

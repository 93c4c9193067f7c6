// Corners of segments where nothing captures points: each corner makes its own.
#include "gl/strand_point.glsl"

uniform sampler2D u_points;    // place in head space, m, and number of the strand; one more at both ends
uniform sampler2D u_strands;

out float v_across_px;
out vec4 v_light;
out vec3 v_line;

vec4 point_at(int number) {
  const int kPointsPerRow = 2048;
  return texelFetch(u_points, ivec2(number % kPointsPerRow, number / kPointsPerRow), 0);
}

void main() {
  int number = gl_VertexID >> 1;
  vec4 here = point_at(number + 1);
  uvec4 strand = uvec4(texelFetch(u_strands, strand_place(uint(here.w)), 0));
  StrandPoint point = strand_point(point_at(number).xyz, here.xyz, point_at(number + 2).xyz, strand, uint(number));
  float side = (gl_VertexID & 1) == 0 ? 1.0 : -1.0;
  gl_Position = vec4(point.middle + side * point.aside, point.depth, 1.0);
  v_across_px = side * point.line.reach;
  v_light = point.light;
  v_line = vec3(point.line.base, point.line.slope, point.line.peak);
}

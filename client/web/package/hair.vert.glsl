// Corners of segments where nothing captures points: each corner makes its own.
#include "gl/strand_point.glsl"

uniform sampler2D u_points;     // on a lattice in head space, two a texel (prepare.ts); one more at both ends
uniform vec3 u_least_m;
uniform vec3 u_step_m;
uniform sampler2D u_strand_of;
uniform sampler2D u_strands;
uniform sampler2D u_order;      // first points of segments, from back to front
uniform bool u_is_line;         // a corner at each end, a pixel wide

out float v_across_px;
out vec4 v_light;
out vec3 v_line;

ivec2 row_place(int number) {
  const int kPointsPerRow = 2048;
  return ivec2(number % kPointsPerRow, number / kPointsPerRow);
}
vec3 point_at(int number) {
  vec4 both = texelFetch(u_points, row_place(number >> 1), 0);
  uvec2 one = uvec2((number & 1) == 0 ? both.xy : both.zw);
  return u_least_m + u_step_m * vec3(one.x & 65535u, (one.x >> 16) | ((one.y >> 16) << 8), one.y & 65535u);
}

void main() {
  int corner = u_is_line ? (gl_VertexID & 1) << 1 : gl_VertexID & 3;   // of four: two at each end
  int segment = gl_VertexID >> (u_is_line ? 1 : 2);
  int number = int(texelFetch(u_order, row_place(segment), 0).r) + (corner >> 1);
  uint of = uint(texelFetch(u_strand_of, row_place(number), 0).r);
  uvec4 strand = uvec4(texelFetch(u_strands, strand_place(of), 0));
  StrandPoint point = strand_point(point_at(number), point_at(number + 1), point_at(number + 2), strand, uint(number));
  float side = u_is_line ? 0.0 : (corner & 1) == 0 ? 1.0 : -1.0;
  gl_Position = vec4(point.middle + side * point.aside, point.depth, 1.0);
  v_across_px = side * point.line.reach;
  v_light = point.light;
  v_line = vec3(point.line.base, point.line.slope, point.line.peak);
}

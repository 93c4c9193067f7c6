// Points of drawn strands, once each; transform feedback captures both corners that a point has across its strand.
#include "gl/strand_point.glsl"

layout(location = 0) in vec3 in_before_m;
layout(location = 1) in vec3 in_place_m;
layout(location = 2) in vec3 in_behind_m;
layout(location = 3) in uint in_strand;

uniform usampler2D u_strands;

// Of both corners: where, and how far from the middle line; light and opacity; how cover falls with that distance.
out vec4 v_place_0;
out vec4 v_light_0;
out vec4 v_line_0;
out vec4 v_place_1;
out vec4 v_light_1;
out vec4 v_line_1;

void main() {
  uvec4 strand = texelFetch(u_strands, strand_place(in_strand), 0);
  StrandPoint point = strand_point(in_before_m, in_place_m, in_behind_m, strand, uint(gl_VertexID));
  v_place_0 = vec4(point.middle + point.aside, point.depth, point.line.reach);
  v_place_1 = vec4(point.middle - point.aside, point.depth, -point.line.reach);
  v_light_0 = v_light_1 = point.light;
  v_line_0 = v_line_1 = vec4(point.line.base, point.line.slope, point.line.peak, 0.0);
}

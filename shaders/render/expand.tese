// Expand pass: every line of a patch is one strand (or a run of one), evaluated on the curve through the key strand's
// vertices, or between three key strands. Transform feedback captures the lines; nothing is rasterised.
#include "render/strand_curves.glsl"

layout(isolines, equal_spacing) in;

uniform uint u_segments;       // per gap between two vertices
uniform uint u_first_strand;   // of the first line of patch 0
uniform uint u_lines;          // per patch
uniform uint u_first_point;    // of this run along the strand
uniform uint u_run_segments;   // of this run

out vec3 expanded_position_m;
out float expanded_along;      // 0 at the root, 1 at the tip
out vec3 expanded_tangent;     // unit, towards the tip
flat out uint expanded_strand;

void main() {
  uint line = uint(gl_TessCoord.y * float(u_lines) + 0.5);
  uint point = u_first_point + uint(gl_TessCoord.x * float(u_run_segments) + 0.5);
  uint strand = u_first_strand + uint(gl_PrimitiveID) * u_lines + line;

  // The last point of a strand is the end of the last gap, not the start of one behind it.
  uint gap = min(point / u_segments, u_vertex_count - 2u);
  float t = float(point - gap * u_segments) / float(u_segments);
  CurvePoint curve = strand_point(strand, gap, t);
  expanded_position_m = curve.position_m;
  expanded_along = float(point) / float(u_segments * (u_vertex_count - 1u));
  expanded_tangent = unit_or(curve.derivative, vec3(0.0, -1.0, 0.0));
  expanded_strand = strand;
  gl_Position = vec4(0.0);
}

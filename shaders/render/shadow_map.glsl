// What strands add to the light's map in a texel.
#include "lib/coverage.glsl"

noperspective in float v_across_px;
noperspective in float v_width_px;
noperspective in float v_depth_m;

uniform float u_strand_opacity;   // optical depth of a strand that covers all of a texel

float added_depth() { return u_strand_opacity * line_coverage(v_width_px, v_across_px); }

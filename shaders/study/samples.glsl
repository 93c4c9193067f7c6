// Samples of strands on a given grid, for the ways of Woodhouse 2017 (4.2.4) to get them into a volume. Two texels each:
// where it is, in cells from the grid's first node, and its length, m; how it moves, m/s.
#include "shared/scatter_study.h"

layout(binding = kUnitStudySample) uniform samplerBuffer u_sample;

uniform uint u_sample_count;
uniform vec3 u_node_count;  // along each axis

// w = length.
vec4 sample_place(uint i) { return texelFetch(u_sample, int(2u * i)); }
vec4 sample_motion(uint i) { return texelFetch(u_sample, int(2u * i + 1u)); }

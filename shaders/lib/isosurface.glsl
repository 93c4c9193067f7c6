// Diffuse light of hair as a surface (Petrovic et al. 2005): the normal is that of the surface on which the
// density of hair is constant, where Kajiya and Kay's would be any across the strand.
#pragma once
#include "lib/select.glsl"

// Outward, against the gradient of a density; the fallback where its change per length is below min_slope.
vec3 density_normal(vec3 gradient, float min_slope, vec3 fallback) {
  float slope = sqrt(dot(gradient, gradient));
  return select(slope >= min_slope, gradient * (-1.0 / max(slope, 1e-12)), fallback);
}

// Light that wraps around the terminator by a share, with the same sum over all directions as Lambert's at 0.
float wrapped_diffuse(vec3 normal, vec3 to_light, float wrap) {
  return max(dot(normal, to_light) + wrap, 0.0) / ((1.0 + wrap) * (1.0 + wrap));
}

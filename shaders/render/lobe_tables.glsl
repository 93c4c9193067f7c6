// Lookups of the tables that are made at load (common/render/scatter/lobe_tables.h), for
// lib/scatter_marschner.glsl and lib/dual_scattering.glsl. A sampler that a variant does not use is not
// there.
#include "lib/fibre.glsl"
#include "shared/lobe_tables.h"

uniform sampler3D u_longitudinal_table;
uniform sampler3D u_azimuthal_table;
uniform sampler3D u_average_table;

// Coordinate of a share 0..1 of the way from the first texel's middle to the last one's.
float texel_coordinate(float share, uint texels) {
  return (clamp(share, 0.0, 1.0) * float(texels - 1u) + 0.5) / float(texels);
}

vec3 table_longitudinal(float theta_half) {
  float share = theta_half / kPi + 0.5;
  return texture(u_longitudinal_table, vec3(texel_coordinate(share, kHalfAngleTexels), 0.5, 0.5)).rgb;
}

vec3 table_azimuthal(float phi, float cos_diff, float root_absorption) {
  return texture(u_azimuthal_table,
                 vec3(texel_coordinate(phi / kPi, kAzimuthTexels), texel_coordinate(cos_diff, kDifferenceTexels),
                      texel_coordinate(root_absorption / kMaxRootAbsorption, kAbsorptionTexels))).rgb;
}

vec4 table_averages(float cos_inclination, float root_absorption, uint layer) {
  return texture(u_average_table,
                 vec3(texel_coordinate(cos_inclination, kInclinationTexels),
                      texel_coordinate(root_absorption / kMaxRootAbsorption, kAverageAbsorptionTexels),
                      (float(layer) + 0.5) / float(kAverageLayers)));
}

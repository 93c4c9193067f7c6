// Marschner et al. 2003 from tables (common/render/scatter/lobe_tables.h): S = sum over p of M_p N_p / cos^2
// theta_d, times the cosine of the light's inclination. Who includes this has, in front of it,
//   vec3 table_longitudinal(float theta_half)                                        M of R, TT, TRT
//   vec3 table_azimuthal(float phi, float cos_diff, float root_absorption)           N of R, TT, TRT
#pragma once
#include "lib/fibre.glsl"

// Weights bring all models to one brightness on the built-in scene.
const vec3 kMarschnerWeights = vec3(2.0, 0.5, 2.5);

struct MarschnerLobes {
  float r;
  vec3 tt;
  vec3 trt;
};

MarschnerLobes marschner_lobes(ScatterAngles angles, vec3 absorption) {
  vec3 along = table_longitudinal(angles.theta_half);
  vec3 root = sqrt(absorption);
  vec3 red = table_azimuthal(angles.phi, angles.cos_diff, root.x);
  vec3 green = table_azimuthal(angles.phi, angles.cos_diff, root.y);
  vec3 blue = table_azimuthal(angles.phi, angles.cos_diff, root.z);
  float scale = max(cos(angles.theta_in), 0.0) / (angles.cos_diff * angles.cos_diff);
  MarschnerLobes lobes;
  lobes.r = scale * along.x * green.x;
  lobes.tt = scale * along.y * vec3(red.y, green.y, blue.y);
  lobes.trt = scale * along.z * vec3(red.z, green.z, blue.z);
  return lobes;
}

vec3 scatter_marschner(vec3 tangent, vec3 to_light, vec3 to_eye, Fibre fibre) {
  ScatterAngles angles = scatter_angles(tangent, to_light, to_eye);
  angles.theta_half += fibre.tilt;
  MarschnerLobes lobes = marschner_lobes(angles, fibre.absorption);
  vec3 weights = kLightOfWhite * kMarschnerWeights * fibre.lobes;
  return fibre.diffuse * kajiya_kay_diffuse(tangent, to_light) * fibre.color + vec3(weights.x * lobes.r) +
         weights.y * lobes.tt + weights.z * lobes.trt;
}

// Sadeghi et al. 2010, the artist's lobes: R, TT and TRT of simple shape, with the longitudinal shifts and
// widths of Marschner et al. 2003, over Kajiya and Kay's diffuse term. Without the cosine of the inclination,
// as it was tuned.
#pragma once
#include "lib/fibre.glsl"

// Azimuthal widths (gamma_TT, gamma_g) and the strength of the glints, at most 0.5.
const float kAzimuthTT = 35.0 * kDegree;
const float kAzimuthGlint = 15.0 * kDegree;
const float kGlint = 0.4;
// Artist's weights, chosen by eye on the built-in scene.
const float kLobeR = 0.07;
const float kLobeTT = 0.25;
const float kLobeTRT = 1.10;

// Strengths (R, TT, TRT) of the three lobes, longitudinal times azimuthal part over cos^2 of the difference
// angle. The glint's azimuth is 30..45 degrees, random per strand.
vec3 sadeghi_lobes(ScatterAngles angles, Fibre fibre) {
  vec3 longitudinal = vec3(unit_bell(fibre.width, angles.theta_half - fibre.shift),
                           unit_bell(0.5 * fibre.width, angles.theta_half + 0.5 * fibre.shift),
                           unit_bell(2.0 * fibre.width, angles.theta_half + 1.5 * fibre.shift));
  vec3 azimuthal = vec3(angles.cos_half_phi, bell(kAzimuthTT, kPi - angles.phi),
                        angles.cos_half_phi + kGlint * bell(kAzimuthGlint, fibre.glint - angles.phi));
  return kHalfAngleNorm * longitudinal * azimuthal / (angles.cos_diff * angles.cos_diff);
}

vec3 scatter_sadeghi(vec3 tangent, vec3 to_light, vec3 to_eye, Fibre fibre) {
  ScatterAngles angles = scatter_angles(tangent, to_light, to_eye);
  angles.theta_half += fibre.tilt;
  vec3 lobes = sadeghi_lobes(angles, fibre) * fibre.lobes;
  // R leaves the surface and keeps the light's colour; TT and TRT went through the strand once and twice.
  vec3 through = sqrt(fibre.color);
  return fibre.diffuse * kajiya_kay_diffuse(tangent, to_light) * fibre.color + kLobeR * lobes.x +
         kLobeTT * lobes.y * through + kLobeTRT * lobes.z * fibre.color;
}

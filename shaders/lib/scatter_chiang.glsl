// Chiang et al. 2016 (with d'Eon et al. 2011 along the fibre): the rough fibre that conserves energy, seen
// from so far that all entries into it are one, and the reference for the other models. The formulae are
// those of common/render/scatter/chiang.h; the mean over the fibre has few points, which roughness hides.
#pragma once
#include "lib/fibre.glsl"

// Logistic scale of the azimuth at roughness 0.3.
const float kAzimuthScale = 0.117160;
const int kEntries = 24;
// Weights bring all models to one brightness on the built-in scene.
const vec3 kChiangWeights = vec3(2.0, 0.5, 2.5);

// exp(-x) I0(x), x >= 0 (Abramowitz and Stegun 9.8.1 and 9.8.2; error below 2e-7).
float scaled_bessel_0(float x) {
  float t = squared(min(x, 3.75) / 3.75);
  float near = 0.2659732 + t * (0.0360768 + t * 0.0045813);
  near = 1.0 + t * (3.5156229 + t * (3.0899424 + t * (1.2067492 + t * near)));
  near *= exp(-min(x, 3.75));
  float s = 3.75 / max(x, 3.75);
  float far = -0.02057706 + s * (0.02635537 + s * (-0.01647633 + s * 0.00392377));
  far = 0.00225319 + s * (-0.00157565 + s * (0.00916281 + s * far));
  far = (0.39894228 + s * (0.01328592 + s * far)) / sqrt(max(x, 3.75));
  return select(x < 3.75, near, far);
}

// M: cos in cos out - sin in sin out is the cosine of the sum, and 1 less that twice the square of a sine.
float rough_longitudinal(float variance, float theta_in, float theta_out) {
  float cosines = cos(theta_in) * cos(theta_out);
  // The cosine of an inclination that the scales turn past the fibre's end counts as positive.
  float half_way =
      select(cosines < 0.0, cos(0.5 * (theta_in - theta_out)), sin(0.5 * (theta_in + theta_out)));
  return scaled_bessel_0(abs(cosines) / variance) * exp(-2.0 * half_way * half_way / variance) /
         (variance * (1.0 - exp(-2.0 / variance)));
}

// Logistic distribution cut to -pi .. pi, of an angle in turns.
float trimmed_logistic(float angle) {
  float x = angle - 2.0 * kPi * floor(angle / (2.0 * kPi) + 0.5);
  float decay = exp(-abs(x) / kAzimuthScale);
  float edge = exp(-kPi / kAzimuthScale);
  return decay / (kAzimuthScale * squared(1.0 + decay)) * ((1.0 + edge) / (1.0 - edge));
}

// Azimuthal parts of R, TT, TRT and the rest: the means over the fibre of A_p times the distribution about
// its exit.
struct RoughLobes {
  vec3 r;
  vec3 tt;
  vec3 trt;
  vec3 rest;
};

RoughLobes rough_azimuthal(float phi, float theta_out, vec3 absorption) {
  float sin_out = sin(theta_out);
  float cos_out = max(cos(theta_out), kMinCosine);
  float index = sqrt(kHairIndex * kHairIndex - sin_out * sin_out) / cos_out;
  vec3 path = -2.0 * absorption / sqrt(1.0 - squared(sin_out / kHairIndex));
  RoughLobes sum;
  // At the edge, where all is reflected, the mean over midpoints is too large by this (Euler-Maclaurin).
  const float kStep = kPi / float(kEntries);
  sum.r = vec3(-kStep * kStep / 24.0 * trimmed_logistic(phi + kPi));
  sum.tt = vec3(0.0);
  sum.trt = vec3(0.0);
  sum.rest = vec3(0.0);
  for (int i = 0; i < kEntries; ++i) {
    // Even in gamma = asin h.
    float gamma = kPi * ((float(i) + 0.5) / float(kEntries) - 0.5);
    float h = sin(gamma);
    float weight = cos(gamma) * (0.5 * kPi / float(kEntries));
    float refracted = asin(h / index);
    float fresnel = hair_fresnel(cos_out * cos(gamma));
    vec3 pass = exp(path * cos(refracted));
    vec3 share = (1.0 - fresnel) * (1.0 - fresnel) * pass;
    sum.r += vec3(weight * fresnel * trimmed_logistic(phi + 2.0 * gamma));
    sum.tt += weight * trimmed_logistic(phi - (2.0 * refracted - 2.0 * gamma + kPi)) * share;
    share = share * pass * fresnel;
    sum.trt += weight * trimmed_logistic(phi - (4.0 * refracted - 2.0 * gamma)) * share;
    sum.rest += (weight / (2.0 * kPi)) * share * pass * fresnel / max(vec3(1.0) - pass * fresnel, vec3(1e-4));
  }
  return sum;
}

vec3 scatter_chiang(vec3 tangent, vec3 to_light, vec3 to_eye, Fibre fibre) {
  ScatterAngles angles = scatter_angles(tangent, to_light, to_eye);
  RoughLobes lobes = rough_azimuthal(angles.phi, angles.theta_out, fibre.absorption);
  // Widths of the sum of the inclinations are twice those of the half angle.
  float variance = squared(2.0 * fibre.width);
  float theta_in = angles.theta_in + 2.0 * fibre.tilt;
  float tilt = -fibre.shift;
  float along_r = rough_longitudinal(variance, theta_in + 2.0 * tilt, angles.theta_out);
  float along_tt = rough_longitudinal(0.25 * variance, theta_in - tilt, angles.theta_out);
  float along_trt = rough_longitudinal(4.0 * variance, theta_in - 4.0 * tilt, angles.theta_out);
  float along_rest = rough_longitudinal(4.0 * variance, theta_in, angles.theta_out);
  vec3 weights = kLightOfWhite * kChiangWeights * fibre.lobes;
  return fibre.diffuse * kajiya_kay_diffuse(tangent, to_light) * fibre.color + weights.x * along_r * lobes.r +
         weights.y * along_tt * lobes.tt + weights.z * (along_trt * lobes.trt + along_rest * lobes.rest);
}

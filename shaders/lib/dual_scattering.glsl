// Dual scattering (Zinke et al. 2008): light that other strands let through or scatter on is brighter and
// wider than the direct light, and what lies around a strand gives some of it back. Who includes this has, in
// front of it, what the tables of common/render/scatter/lobe_tables.h hold of a fibre:
//   vec4 table_averages(float cos_inclination, float root_absorption, uint layer)
// Deviation: a strand takes part of the direct light according to how likely it is that none was crossed,
// where the paper has either all or nothing; and behind a mean of n strands, which chance spreads, the mean
// of a_f^n is exp(-n (1 - a_f)).
#pragma once
#include "lib/fibre.glsl"

const float kForwardDensity = 0.7;  // d_f
const float kBackDensity = 0.7;     // d_b
// The strands around one are not parallel to it, as the paper has them: variance of what they scatter, rad^2.
const float kCrowdSpread = 20.0 * kDegree * (20.0 * kDegree);

// For the three colours. Forward and back: a_f, a_b, alpha, beta.
struct FibreAverages {
  vec3 forward;
  vec3 back;
  vec3 forward_shift;
  vec3 back_shift;
  vec3 forward_width;
  vec3 back_width;
};

struct BackScatter {
  vec3 albedo;  // A_b
  vec3 shift;   // Delta_b
  vec3 width;   // sigma_b
};

// Equations 14 to 16.
BackScatter back_scatter(FibreAverages means) {
  vec3 f2 = means.forward * means.forward;
  vec3 b = means.back;
  vec3 b3 = b * b * b;
  vec3 kept = max(vec3(1.0) - f2, vec3(1e-6));
  vec3 ff = 2.0 * means.forward_width * means.forward_width;
  vec3 bb = means.back_width * means.back_width;
  BackScatter back;
  back.albedo = b * f2 / kept + b3 * f2 / (kept * kept * kept);
  back.shift = means.back_shift * (vec3(1.0) - 2.0 * b * b / (kept * kept)) +
               means.forward_shift * (2.0 * kept * kept + 4.0 * f2 * b * b) / (kept * kept * kept);
  back.width = (vec3(1.0) + kBackDensity * f2) * (b * sqrt(ff + bb) + b3 * sqrt(ff + 3.0 * bb)) /
               (b + b3 * (2.0 * means.forward_width + 3.0 * means.back_width));
  return back;
}

vec3 unit_bells(vec3 width, vec3 x) { return exp(-0.5 * x * x / (width * width)) / (width * sqrt(2.0 * kPi)); }

// f_back over half of the sphere; spread: variance that the light got on its way.
vec3 back_lobe(BackScatter back, float theta_half, float cos_diff, vec3 spread) {
  vec3 width = sqrt(back.width * back.width + spread);
  return 2.0 * kHalfAngleNorm * back.albedo * unit_bells(width, theta_half - back.shift) /
         (kPi * cos_diff * cos_diff);
}

// Mean share that gets through a crowd.
vec3 mean_transmittance(vec3 forward, float crossed) { return exp(-crossed * (vec3(1.0) - forward)); }

// What goes to the eye of a unit of light in front of the hair. single: what the strand scatters of a unit at
// itself; crossed: mean number of strands on the light's way.
vec3 dual_scattering(ScatterAngles angles, Fibre fibre, vec3 single, float crossed) {
  vec3 root = sqrt(fibre.absorption);
  float cos_in = max(cos(angles.theta_in), 0.0);
  vec4 red = table_averages(angles.cos_diff, root.x, 0u);
  vec4 green = table_averages(angles.cos_diff, root.y, 0u);
  vec4 blue = table_averages(angles.cos_diff, root.z, 0u);
  vec4 red_1 = table_averages(angles.cos_diff, root.x, 1u);
  vec4 green_1 = table_averages(angles.cos_diff, root.y, 1u);
  vec4 blue_1 = table_averages(angles.cos_diff, root.z, 1u);
  vec4 red_2 = table_averages(angles.cos_diff, root.x, 2u);
  vec4 green_2 = table_averages(angles.cos_diff, root.y, 2u);
  vec4 blue_2 = table_averages(angles.cos_diff, root.z, 2u);
  FibreAverages means;
  means.forward = vec3(red.x, green.x, blue.x);
  means.back = vec3(red.y, green.y, blue.y);
  means.forward_shift = fibre.shift * vec3(red_1.y, green_1.y, blue_1.y);
  means.back_shift = fibre.shift * vec3(red_1.z, green_1.z, blue_1.z);
  means.forward_width = fibre.width * vec3(red_2.x, green_2.x, blue_2.x);
  means.back_width = fibre.width * vec3(red_2.y, green_2.y, blue_2.y);

  // On its way the light meets strands at its own inclination.
  vec3 forward = vec3(table_averages(cos_in, root.x, 0u).x, table_averages(cos_in, root.y, 0u).x,
                      table_averages(cos_in, root.z, 0u).x);
  float direct = exp(-crossed);
  vec3 indirect = max(mean_transmittance(forward, crossed) - direct, 0.0);
  vec3 spread = crossed * means.forward_width * means.forward_width + kCrowdSpread;

  BackScatter back = back_scatter(means);
  float theta = angles.theta_half;
  // f_s of light that comes from half of all azimuths.
  float norm = kHalfAngleNorm / (angles.cos_diff * angles.cos_diff);
  vec3 width_r = sqrt(fibre.width * fibre.width + spread);
  vec3 width_tt = sqrt(0.25 * fibre.width * fibre.width + spread);
  vec3 width_trt = sqrt(4.0 * fibre.width * fibre.width + spread);
  vec3 scattered =
      norm * (unit_bells(width_r, vec3(theta - fibre.shift)) * vec3(red.z, green.z, blue.z) +
              unit_bells(width_tt, vec3(theta + 0.5 * fibre.shift)) * vec3(red.w, green.w, blue.w) +
              unit_bells(width_trt, vec3(theta + 1.5 * fibre.shift)) * vec3(red_1.x, green_1.x, blue_1.x));
  vec3 around = kBackDensity * back_lobe(back, theta, angles.cos_diff, vec3(kCrowdSpread));
  vec3 around_spread = kPi * kBackDensity * back_lobe(back, theta, angles.cos_diff, spread);
  float light = kLightOfWhite * cos_in;
  return direct * (single + light * around) + kForwardDensity * light * indirect * (scattered + around_spread);
}

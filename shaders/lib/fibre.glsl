// A strand as light finds it, and what all models of shading share. A model is a function
//   vec3 scatter_NAME(vec3 tangent, vec3 to_light, vec3 to_eye, Fibre fibre)
// in a file of its own: what of a unit of light goes to the eye. Directions are unit vectors and point away
// from the strand, `tangent` from root to tip. Each has its ground truth in double precision in
// common/render/scatter.
#pragma once
#include "lib/select.glsl"

const float kPi = 3.14159265359;
const float kDegree = kPi / 180.0;
const float kHairIndex = 1.55;
// Below this the two directions are nearly along the strand and have no azimuth.
const float kMinCosine = 0.02;
// A unit Gaussian in the half angle integrates to 2 over the outgoing angle; half of it to 1.
const float kHalfAngleNorm = 0.5;
// Light is given as what a white diffuse surface makes of it: pi times as much meets the strand.
const float kLightOfWhite = kPi;

struct Fibre {
  vec3 color;       // linear, of hair as a whole
  vec3 absorption;  // per radius
  vec3 lobes;       // weights of R, TT and TRT, 1 = as the model has them
  float diffuse;    // weight of what scatters everywhere
  float width;      // longitudinal, of R in the half angle, rad: beta_R
  float shift;      // longitudinal, of R in the half angle, rad: alpha_R, below 0 towards the root
  float tilt;       // this strand's own, on top, rad
  float glint;      // azimuth of this strand's glint, rad
};

// Gaussian of height 1.
float bell(float width, float x) { return exp(-0.5 * (x * x) / (width * width)); }

// Gaussian of area 1.
float unit_bell(float width, float x) { return bell(width, x) / (width * sqrt(2.0 * kPi)); }

// What of the light that meets a strand scatters everywhere (Kajiya and Kay 1989).
float kajiya_kay_diffuse(vec3 tangent, vec3 to_light) {
  float along = dot(tangent, to_light);
  return sqrt(max(0.0, 1.0 - along * along));
}

struct ScatterAngles {
  float theta_half;    // mean inclination to the normal plane, rad
  float cos_diff;      // cosine of half the difference of inclinations
  float phi;           // between the projections on the normal plane, 0..pi
  float cos_half_phi;
  float cos_phi;
  float theta_in;
  float theta_out;
};

ScatterAngles scatter_angles(vec3 tangent, vec3 to_light, vec3 to_eye) {
  float sin_in = clamp(dot(tangent, to_light), -1.0, 1.0);
  float sin_out = clamp(dot(tangent, to_eye), -1.0, 1.0);
  float theta_in = asin(sin_in);
  float theta_out = asin(sin_out);
  vec3 light_across = to_light - sin_in * tangent;
  vec3 eye_across = to_eye - sin_out * tangent;
  float lengths = sqrt(dot(light_across, light_across) * dot(eye_across, eye_across));
  float cos_phi =
      select(lengths > 0.0, clamp(dot(light_across, eye_across) / max(lengths, 1e-12), -1.0, 1.0), 1.0);
  ScatterAngles angles;
  angles.theta_half = 0.5 * (theta_in + theta_out);
  angles.cos_diff = max(cos(0.5 * (theta_out - theta_in)), kMinCosine);
  angles.phi = acos(cos_phi);
  angles.cos_half_phi = sqrt(max(0.0, 0.5 + 0.5 * cos_phi));
  angles.cos_phi = cos_phi;
  angles.theta_in = theta_in;
  angles.theta_out = theta_out;
  return angles;
}

// Absorption per radius with which hair as a whole has this colour (Chiang et al. 2016, equation 9 at
// azimuthal roughness 0.3; common/scene/hair_color.h has the fit for all).
const float kColorFit = 5.8884;
const float kDarkestColor = 1e-3;
const float kLogOfTwo = 0.69314718056;

float squared(float x) { return x * x; }

float channel_absorption(float color) {
  return squared(log2(clamp(color, kDarkestColor, 1.0)) * (kLogOfTwo / kColorFit));
}

vec3 fibre_absorption(vec3 color) {
  return vec3(channel_absorption(color.x), channel_absorption(color.y), channel_absorption(color.z));
}

// Reflectance of hair for unpolarised light.
float hair_fresnel(float cos_incidence) {
  float cos_i = clamp(cos_incidence, 0.0, 1.0);
  float cos_t = sqrt(1.0 - (1.0 - cos_i * cos_i) / (kHairIndex * kHairIndex));
  float across = (cos_i - kHairIndex * cos_t) / (cos_i + kHairIndex * cos_t);
  float along = (kHairIndex * cos_i - cos_t) / (kHairIndex * cos_i + cos_t);
  return 0.5 * (across * across + along * along);
}

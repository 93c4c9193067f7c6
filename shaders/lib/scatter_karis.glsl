// Karis 2016 (Physically Based Hair Shading in Unreal): closed fits to R, TT and TRT of a smooth fibre, and
// Gaussians in the sum of the sines. No cosine and no difference angle: the fit has them.
#pragma once
#include "lib/fibre.glsl"

// The lobes of the fit are brighter or darker than what they stand for by little; weights bring all models to
// one brightness on the built-in scene.
const vec3 kKarisWeights = vec3(2.0, 0.5, 2.5);

float schlick_fresnel(float cosine) {
  const float root = (1.0 - kHairIndex) / (1.0 + kHairIndex);
  const float straight = root * root;
  float x = 1.0 - cosine;
  float x2 = x * x;
  return straight + (1.0 - straight) * x2 * x2 * x;
}

struct KarisLobes {
  float r;
  vec3 tt;
  vec3 trt;
};

// Azimuthal parts, with Fresnel and the colour of what was passed. R is exact but for its Fresnel: Schlick's is 22 % below
// the true one at 60 degrees of incidence, which is an azimuth of 120, and a fifth of R is missing there, as in Karis'.
KarisLobes karis_azimuthal(vec3 color, ScatterAngles angles, float cos_light_eye) {
  float index = 1.19 / angles.cos_diff + 0.36 * angles.cos_diff;
  float a = 1.0 / index;
  float h = angles.cos_half_phi * (1.0 + a * (0.6 - 0.8 * angles.cos_phi));
  float cos_gamma = sqrt(max(0.0, 1.0 - h * h));
  float entering = 1.0 - schlick_fresnel(angles.cos_diff * cos_gamma);
  float inside = schlick_fresnel(0.5 * angles.cos_diff);
  KarisLobes lobes;
  lobes.r = 0.25 * angles.cos_half_phi * schlick_fresnel(sqrt(max(0.0, 0.5 + 0.5 * cos_light_eye)));
  lobes.tt = entering * entering * exp(-3.65 * angles.cos_phi - 3.98) *
             pow(color, vec3(sqrt(max(0.0, 1.0 - h * h * (a * a))) / (2.0 * angles.cos_diff)));
  lobes.trt = (1.0 - inside) * (1.0 - inside) * inside * exp(17.0 * angles.cos_phi - 16.78) *
              pow(color, vec3(0.8 / angles.cos_diff));
  return lobes;
}

vec3 scatter_karis(vec3 tangent, vec3 to_light, vec3 to_eye, Fibre fibre) {
  ScatterAngles angles = scatter_angles(tangent, to_light, to_eye);
  KarisLobes lobes =
      karis_azimuthal(clamp(fibre.color, kDarkestColor, 1.0), angles, clamp(dot(to_light, to_eye), -1.0, 1.0));
  // Twice the half angle: a, 2 b. The shifts of TT and TRT are -1/2 and -2 times that of R here.
  float sines = dot(tangent, to_light) + dot(tangent, to_eye) + 2.0 * fibre.tilt;
  float width = 2.0 * fibre.width;
  float r = unit_bell(width, sines - 2.0 * fibre.shift) * lobes.r;
  vec3 tt = unit_bell(0.5 * width, sines + fibre.shift) * lobes.tt;
  vec3 trt = unit_bell(2.0 * width, sines + 4.0 * fibre.shift) * lobes.trt;
  vec3 weights = kLightOfWhite * kKarisWeights * fibre.lobes;
  return fibre.diffuse * kajiya_kay_diffuse(tangent, to_light) * fibre.color + vec3(weights.x * r) + weights.y * tt +
         weights.z * trt;
}

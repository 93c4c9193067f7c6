// Light scattered by one strand. Directions are unit vectors and point away from the strand: `tangent` from root to
// tip, `to_light`, `to_eye`.
// Kajiya and Kay 1989 (diffuse, and specular with both directions outward); Sadeghi et al. 2010 for the lobes R, TT
// and TRT with the longitudinal shifts and widths of Marschner et al. 2003, table 1.

const float kPi = 3.14159265359;
const float kDegree = kPi / 180.0;

// Longitudinal shifts: alpha_R within -10..-5 degrees, alpha_TT = -alpha_R / 2, alpha_TRT = -3 alpha_R / 2.
const float kShiftR = -7.0 * kDegree;
const float kShiftTT = -0.5 * kShiftR;
const float kShiftTRT = -1.5 * kShiftR;
// Longitudinal widths: beta_R within 5..10 degrees, beta_TT = beta_R / 2, beta_TRT = 2 beta_R.
const float kWidthR = 7.5 * kDegree;
const float kWidthTT = 0.5 * kWidthR;
const float kWidthTRT = 2.0 * kWidthR;
// Azimuthal widths (Sadeghi: gamma_TT, gamma_g) and the strength of the glints, at most 0.5.
const float kAzimuthTT = 35.0 * kDegree;
const float kAzimuthGlint = 15.0 * kDegree;
const float kGlint = 0.4;
// A unit Gaussian in the half angle integrates to 2 over the outgoing angle; half of it to 1.
const float kHalfAngleNorm = 0.5;
// Below this the two directions are nearly along the strand and have no azimuth.
const float kMinCosine = 0.02;

float kajiya_kay_diffuse(vec3 tangent, vec3 to_light) {
  float along = dot(tangent, to_light);
  return sqrt(max(0.0, 1.0 - along * along));
}

float kajiya_kay_specular(vec3 tangent, vec3 to_light, vec3 to_eye, float power) {
  float light_along = dot(tangent, to_light);
  float eye_along = dot(tangent, to_eye);
  float light_across = sqrt(max(0.0, 1.0 - light_along * light_along));
  float eye_across = sqrt(max(0.0, 1.0 - eye_along * eye_along));
  return pow(max(0.0, light_across * eye_across - light_along * eye_along), power);
}

// Gaussian of height 1.
float bell(float width, float x) { return exp(-0.5 * (x * x) / (width * width)); }

// Gaussian of area 1.
float unit_bell(float width, float x) { return bell(width, x) / (width * sqrt(2.0 * kPi)); }

struct ScatterAngles {
  float theta_half;   // mean inclination to the normal plane, rad
  float cos_diff;     // cosine of half the difference of inclinations
  float phi;          // between the projections on the normal plane, 0..pi
  float cos_half_phi;
};

ScatterAngles scatter_angles(vec3 tangent, vec3 to_light, vec3 to_eye) {
  float sin_in = clamp(dot(tangent, to_light), -1.0, 1.0);
  float sin_out = clamp(dot(tangent, to_eye), -1.0, 1.0);
  float theta_in = asin(sin_in);
  float theta_out = asin(sin_out);
  vec3 light_across = to_light - sin_in * tangent;
  vec3 eye_across = to_eye - sin_out * tangent;
  float lengths = sqrt(dot(light_across, light_across) * dot(eye_across, eye_across));
  float cos_phi = lengths > 0.0 ? clamp(dot(light_across, eye_across) / max(lengths, 1e-12), -1.0, 1.0) : 1.0;
  ScatterAngles angles;
  angles.theta_half = 0.5 * (theta_in + theta_out);
  angles.cos_diff = max(cos(0.5 * (theta_out - theta_in)), kMinCosine);
  angles.phi = acos(cos_phi);
  angles.cos_half_phi = sqrt(max(0.0, 0.5 + 0.5 * cos_phi));
  return angles;
}

// Strengths (R, TT, TRT) of the three lobes, longitudinal times azimuthal part over cos^2 of the difference angle.
// glint_phi: where this strand's glint sits, rad (Sadeghi: 30..45 degrees, random per strand).
vec3 sadeghi_lobes(ScatterAngles angles, float glint_phi) {
  vec3 longitudinal = vec3(unit_bell(kWidthR, angles.theta_half - kShiftR),
                           unit_bell(kWidthTT, angles.theta_half - kShiftTT),
                           unit_bell(kWidthTRT, angles.theta_half - kShiftTRT));
  vec3 azimuthal = vec3(angles.cos_half_phi, bell(kAzimuthTT, kPi - angles.phi),
                        angles.cos_half_phi + kGlint * bell(kAzimuthGlint, glint_phi - angles.phi));
  return kHalfAngleNorm * longitudinal * azimuthal / (angles.cos_diff * angles.cos_diff);
}

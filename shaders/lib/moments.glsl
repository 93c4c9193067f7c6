// Transmittance from four moments of depth (Muenstermann et al. 2018, "Moment-based order-independent transparency",
// power moments; the bounds of Peters and Klein 2015, "Moment shadow mapping", from which the solution follows).
// An absorbance -ln(1 - opacity) at depth z in [-1, 1] adds itself times (z, z^2, z^3, z^4) to the moments.

// Moments of single precision are pulled towards those of a spread-out distribution, so that they stay moments.
const float kMomentBias = 5e-7;
const vec4 kBiasMoments = vec4(0.0, 0.375, 0.0, 0.375);
// Between the least and the greatest absorbance that the moments allow in front of a depth.
const float kOverestimation = 0.1;
const float kLeastAbsorbance = 1e-3;
const float kMostAbsorbance = 8.0;   // of one fragment

float absorbance(float opacity) { return min(-log(max(1.0 - opacity, 1e-7)), kMostAbsorbance); }

// Share of the light that passes what lies in front of `z`: total absorbance `b0`, moments `b` as they were summed.
float transmittance_at(float z, float b0, vec4 sum, float overestimation) {
  vec4 b = mix(sum / b0, kBiasMoments, kMomentBias);
  // Cholesky factors of the Hankel matrix of (1, b1, b2, b3, b4), and the solution c for (1, z, z^2).
  float d22 = b.y - b.x * b.x;
  float l32_d22 = b.z - b.x * b.y;
  float l32 = l32_d22 / d22;
  float d33 = (b.w - b.y * b.y) - l32 * l32_d22;
  vec3 c = vec3(1.0, z, z * z);
  c.y -= b.x;
  c.z -= b.y + l32 * c.y;
  c.y /= d22;
  c.z /= d33;
  c.y -= l32 * c.z;
  c.x -= dot(c.yz, b.xy);
  // The other two depths of the distribution of three depths that has these moments.
  float p = c.y / c.z;
  float q = c.x / c.z;
  float root = sqrt(max(0.25 * p * p - q, 0.0));
  float z1 = -0.5 * p - root;
  float z2 = -0.5 * p + root;
  // Absorbance in front: 1 for a depth in front of z, 0 behind it, `overestimation` at z itself. Newton's polynomial
  // through the three, whose mean follows from the moments.
  float f0 = overestimation;
  float f1 = z1 < z ? 1.0 : 0.0;
  float f2 = z2 < z ? 1.0 : 0.0;
  float f01 = (f1 - f0) / (z1 - z);
  float f12 = (f2 - f1) / (z2 - z1);
  float f012 = (f12 - f01) / (z2 - z);
  float share = f0 + f01 * (b.x - z) + f012 * (b.y - b.x * (z + z1) + z * z1);
  return exp(-b0 * clamp(share, 0.0, 1.0));
}

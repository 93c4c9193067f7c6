// Moments: depth as the moments take it.
uniform float u_hair_near_m;   // of the hair
uniform float u_hair_far_m;

// Logarithm of the distance, so that near layers are told apart as well as far ones; -1 and 1 at the ends of the hair.
float moment_depth(float distance_m) {
  return clamp(2.0 * log(max(distance_m, 1e-6) / u_hair_near_m) / log(u_hair_far_m / u_hair_near_m) - 1.0, -1.0, 1.0);
}

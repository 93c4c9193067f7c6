// Turbulence over the size of a head: waves that the wind carries along.
#pragma variant HAS_TURBULENCE 0 1
#include "sim/step.glsl"

#ifndef LANES
#define GUST_COUNT kMaxGustWaves
#endif

// Wind beside the mean wind; waves that are not there have no amplitude.
vec3 gust_velocity(vec3 point) {
  vec3 gust = vec3(0.0);
#if HAS_TURBULENCE
  for (uint i = 0u; i < GUST_COUNT; ++i) {
    const vec4 amplitude = u_step.gust_amplitude[i];
    gust += amplitude.xyz * sin(dot(u_step.gust_wave[i].xyz, point) - amplitude.w);
  }
#endif
  return gust;
}

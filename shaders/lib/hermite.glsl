// Cubic Hermite curves through the vertices of a strand (Catmull 1974 tangents, one-sided at the ends). The basis is
// exactly 0 or 1 at t = 0 and t = 1, so that a curve passes bit for bit through its vertices.
#pragma once
#include "lib/select.glsl"

struct HermiteGap {
  vec3 p0;
  vec3 m0;
  vec3 p1;
  vec3 m1;
};

LAW vec3 hermite_point(HermiteGap g, float t) {
  float t2 = t * t;
  float t3 = t2 * t;
  float h01 = 3.0 * t2 - 2.0 * t3;
  return (1.0 - h01) * g.p0 + (t3 - 2.0 * t2 + t) * g.m0 + h01 * g.p1 + (t3 - t2) * g.m1;
}

// Derivative by t.
LAW vec3 hermite_derivative(HermiteGap g, float t) {
  float t2 = t * t;
  float d01 = 6.0 * (t - t2);
  return d01 * (g.p1 - g.p0) + (3.0 * t2 - 4.0 * t + 1.0) * g.m0 + (3.0 * t2 - 2.0 * t) * g.m1;
}

// Below this squared length, m^2, a direction counts as unknown: vertices coincide.
const float kMinDirectionSquared = 1e-24;

// v as a unit vector, or the fallback where v has no direction.
LAW vec3 unit_or(vec3 v, vec3 fallback) {
  float squared = dot(v, v);
  return select(squared > kMinDirectionSquared, v * inversesqrt(max(squared, kMinDirectionSquared)), fallback);
}

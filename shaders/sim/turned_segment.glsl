// Segments turned about their start, at their length, out of what they have met, and ends held by friction.
#include "sim/step.glsl"

// The end of a segment turned about its start, on its side, until it stands so high over the start along the normal:
// straight up or down where it is too short for that.
vec3 turned_to_height(vec3 start, vec3 towards, float segment, vec3 normal, float height) {
  const float cosine = clamp(height / segment, -1.0, 1.0);
  vec3 side = towards - normal * dot(towards, normal);
  const vec3 other = select(abs(normal.x) < 0.6, vec3(0.0, normal.z, -normal.y), vec3(-normal.z, 0.0, normal.x));
  side = select(dot(side, side) > 1e-12 * segment * segment, side, other);
  side -= normal * dot(side, normal);  // once more: a short side is made of roundings along the normal
  const float sine = sqrt(1.0 - cosine * cosine) * inversesqrt(max(dot(side, side), kTinySquared));
  return start + segment * (cosine * normal + sine * side);
}

// The end, as far back towards where it was as friction of so much holds it along the surface.
vec3 held_back(vec3 before, vec3 end, vec3 normal, float hold) {
  const vec3 slip = end - before;
  const vec3 sliding = slip - normal * dot(slip, normal);
  return end - sliding * min(1.0, hold * inversesqrt(max(dot(sliding, sliding), kTinySquared)));
}

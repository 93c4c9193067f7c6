// Colliders: which one a point is inside of, and a segment turned out of it.
#pragma variant COLLIDERS 0 1 4 16
#include "sim/step.glsl"

// Where strands are lanes, one variant does for any number of colliders.
#ifndef LANES
#define COLLIDER_COUNT uint(COLLIDERS)
#endif
// Times a vertex inside several colliders is pushed, out of the deepest first.
#define PUSH_ROUNDS (COLLIDER_COUNT > 1u ? 2 : 1)

// The end of a segment turned about its start until it lies on a sphere: both equations of Woodhouse, figure 4.1 at
// once, by the law of cosines; the nearest end that can be had when there is none. `direction` is the
// segment's now.
vec3 turned_onto_sphere(vec3 start, vec3 direction, float segment, vec3 center, float radius) {
  const vec3 to_center = center - start;
  const float squared = dot(to_center, to_center);
  const float inverse = inversesqrt(max(squared, kTinySquared));
  const vec3 axis = to_center * inverse;
  const float along = (segment * segment + squared - radius * radius) * inverse;
  const float cosine = clamp(along / max(2.0 * segment, kTinySquared), -1.0, 1.0);
  vec3 side = direction - axis * dot(direction, axis);
  // Straight at the centre: any side will do.
  const vec3 other = select(abs(axis.x) < 0.6, vec3(0.0, axis.z, -axis.y), vec3(-axis.z, 0.0, axis.x));
  side = select(dot(side, side) > 1e-12, side, other);
  side -= axis * dot(side, axis);  // once more: a short side is made of roundings along the axis
  const float sine = sqrt(1.0 - cosine * cosine) * inversesqrt(max(dot(side, side), kTinySquared));
  const vec3 end = start + segment * (cosine * axis + sine * side);
  return select(squared > kTinySquared, end, start + segment * direction);
}

#if COLLIDERS >= 1
// A sphere as a strand meets it that begins at a place inside of it: no larger than leaves that place.
vec4 around_groomed(vec4 sphere, vec3 groomed) {
  const vec3 outward = groomed - sphere.xyz;
  const float squared = dot(outward, outward);
  return vec4(sphere.xyz, select(squared < sphere.w * sphere.w, sqrt(squared), sphere.w));
}

// The sphere that a point is deepest inside of, by r^2 - d^2; its radius is 0 when the point is in none.
vec4 deepest_collider(vec3 point) {
  vec4 deepest = vec4(0.0);
  float most = 0.0;
  // Constant count and indices: uniform loads stay scalar on llvmpipe.
  for (uint i = 0u; i < COLLIDER_COUNT; ++i) {
    const vec4 sphere = u_step.collider[i];
    const vec3 outward = point - sphere.xyz;
    const float inside = sphere.w * sphere.w - dot(outward, outward);
    deepest = select(inside > most, sphere, deepest);
    most = max(inside, most);
  }
  return deepest;
}
#endif

// Where strands lie: key strands on curves through their vertices, followers between three of them. For whatever expands
// strands into segments.
#pragma variant HAS_FOLLOWERS 0 1
#pragma variant CURVE 0 1
#include "lib/bezier.glsl"
#include "lib/hermite.glsl"
#include "shared/bindings.h"
#if HAS_FOLLOWERS
#include "lib/follower.glsl"
#endif

layout(std430, binding = kBindingKeyPosition) restrict readonly buffer KeyPosition {
  float position_m[];  // (vertex_count x key_count x 3) head space
} keys;
#if HAS_FOLLOWERS
layout(std430, binding = kBindingRootTriangle) restrict readonly buffer RootTriangle {
  uint corner[];  // (triangle_count x 3)
} triangles;
uniform uint u_followers;      // per triangle, numbered
uniform uint u_drawn;          // of them, drawn
uniform float u_clump;         // 0..1, pull towards the nearest key strand at the tip
uniform float u_variation_m;   // how far a follower's tip strays
uniform float u_shorten;       // 0..1, largest part cut off a follower
#endif

uniform uint u_key_count;
uniform uint u_vertex_count;   // per key strand

vec3 key_vertex(uint vertex, uint strand) {
  uint i = 3u * (vertex * u_key_count + strand);
  return vec3(keys.position_m[i], keys.position_m[i + 1u], keys.position_m[i + 2u]);
}

HermiteGap key_gap(uint gap, uint strand) {
  uint last = u_vertex_count - 1u;
  HermiteGap g;
  g.p0 = key_vertex(gap, strand);
  g.p1 = key_vertex(gap + 1u, strand);
#if CURVE == 1
  return bezier_gap(gap == 0u ? g.p0 : key_vertex(gap - 1u, strand), g.p0, g.p1,
                    gap + 1u == last ? g.p1 : key_vertex(gap + 2u, strand));
#else
  g.m0 = gap == 0u ? g.p1 - g.p0 : 0.5 * (g.p1 - key_vertex(gap - 1u, strand));
  g.m1 = gap + 1u == last ? g.p1 - g.p0 : 0.5 * (key_vertex(gap + 2u, strand) - g.p0);
  return g;
#endif
}

struct CurvePoint {
  vec3 position_m;
  vec3 derivative;
};

CurvePoint key_point(uint strand, uint gap, float t) {
  HermiteGap g = key_gap(gap, strand);
  vec3 chord = g.p1 - g.p0;
  vec3 derivative = hermite_derivative(g, t);
  return CurvePoint(hermite_point(g, t), dot(derivative, derivative) > kMinDirectionSquared ? derivative : chord);
}

#if HAS_FOLLOWERS
const float kWaves = 2.5;  // bends of a follower's deviation along its length
const float kTau = 6.28318530718;

// Deviation from the interpolated curve, as a share of u_variation_m: none at the root.
vec3 follower_deviation(uint follower, float along) {
  vec3 direction = 2.0 * vec3(follower_random(follower, kSaltX), follower_random(follower, kSaltY),
                              follower_random(follower, kSaltZ)) - 1.0;
  float phase = follower_random(follower, kSaltPhase);
  float wave = sin(kTau * (kWaves * along + phase)) - sin(kTau * phase);
  return along * (direction + 0.35 * wave * direction.yzx);
}

// `drawn_index` counts only what is drawn; a follower keeps its number, and so its place, when fewer are drawn.
CurvePoint follower_point(uint drawn_index, uint gap, float t) {
  uint drawn_triangle = drawn_index / u_drawn;
  uint follower = drawn_triangle * u_followers + drawn_index - drawn_triangle * u_drawn;
  float last = float(u_vertex_count - 1u);
  float along = (float(gap) + t) / last;
  float end = 1.0 - u_shorten * follower_random(follower, kSaltLength);
  float x = along * end * last;
  uint cut_gap = min(uint(x), u_vertex_count - 2u);
  float cut_t = x - float(cut_gap);
  uint triangle = 3u * drawn_triangle;
  CurvePoint a = key_point(triangles.corner[triangle], cut_gap, cut_t);
  CurvePoint b = key_point(triangles.corner[triangle + 1u], cut_gap, cut_t);
  CurvePoint c = key_point(triangles.corner[triangle + 2u], cut_gap, cut_t);
  vec3 weights = clumped_weights(follower_weights(follower), u_clump * along);
  vec3 position_m = interpolate_keys(weights, a.position_m, b.position_m, c.position_m);
  vec3 derivative = interpolate_keys(weights, a.derivative, b.derivative, c.derivative);
  position_m += u_variation_m * follower_deviation(follower, along);
  return CurvePoint(position_m, dot(derivative, derivative) > kMinDirectionSquared ? derivative : a.derivative);
}
#endif

// A point of a strand, key strands first.
CurvePoint strand_point(uint strand, uint gap, float t) {
#if HAS_FOLLOWERS
  return strand < u_key_count ? key_point(strand, gap, t) : follower_point(strand - u_key_count, gap, t);
#else
  return key_point(strand, gap, t);
#endif
}

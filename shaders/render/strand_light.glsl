// Light that a point of a strand sends to the eye, by the methods that the look names
// (common/scene/render_methods.h). For the vertex stage or the fragment stage, whichever computes it.
#pragma variant SHADING 0 1 2 3 4
#pragma variant SCATTERING 0 1 2 3
#include "lib/fibre.glsl"
#include "lib/hash.glsl"
#include "render/light.glsl"
#include "shared/methods.h"

uniform vec3 u_eye_m;             // head space
uniform vec3 u_root_color;
uniform vec3 u_tip_color;
uniform vec3 u_lobe_weights;      // of R, TT and TRT
uniform float u_highlight_width;  // of R in the half angle, rad
uniform float u_highlight_shift;  // likewise
uniform float u_tilt_spread;      // the cuticle's tilt seems to vary, for strands do not lie perfectly, rad
uniform float u_diffuse;          // weights of the terms
uniform float u_scatter;          // light that arrives through other strands
uniform float u_root_darkening;   // 0..1
uniform float u_strand_variation; // of brightness
uniform float u_warmth_variation; // of red against blue

#include "render/lobe_tables.glsl"
#include "lib/scatter_sadeghi.glsl"
#include "lib/scatter_kajiya_kay.glsl"
#include "lib/scatter_karis.glsl"
#include "lib/scatter_chiang.glsl"
#include "lib/scatter_marschner.glsl"
#include "lib/dual_scattering.glsl"
#include "lib/isosurface.glsl"

// Artist's weights of the terms, chosen by eye on the built-in scene.
const float kScatterReach = 0.35;      // power of the direct part: how deep that light goes
const float kGroundLight = 0.45;       // light from below over light from above
const float kDeepLight = 0.08;         // what is left of it in the middle of the hair, scattered many times
// Variation between strands.
const float kDarkRoots = 0.25;         // of the length
const float kGlintFrom = 30.0 * kDegree;
const float kGlintTo = 45.0 * kDegree;
const uint kSaltBrightness = 0x68bc21ebu;
const uint kSaltWarmth = 0x02e5be93u;
const uint kSaltGlint = 0x967a889bu;
const uint kSaltTilt = 0x3c6ef372u;

float strand_random(uint strand, uint salt) { return unit_float(mix_u32(strand ^ salt)); }

// Of the mean strand.
vec3 mean_color(float along) {
  float dark = 1.0 - u_root_darkening * (1.0 - min(along / kDarkRoots, 1.0));
  return mix(u_root_color, u_tip_color, along * along * (3.0 - 2.0 * along)) * dark;
}

vec3 strand_color(uint strand, float along) {
  float brightness = 1.0 + u_strand_variation * (2.0 * strand_random(strand, kSaltBrightness) - 1.0);
  float warmth = u_warmth_variation * (2.0 * strand_random(strand, kSaltWarmth) - 1.0);
  return mean_color(along) * brightness * vec3(1.0 + warmth, 1.0, 1.0 - warmth);
}

Fibre fibre_of(vec3 color, float tilt, float glint) {
  Fibre fibre;
  fibre.color = color;
  fibre.absorption = fibre_absorption(color);
  fibre.lobes = u_lobe_weights;
  fibre.diffuse = u_diffuse;
  fibre.width = u_highlight_width;
  fibre.shift = u_highlight_shift;
  fibre.tilt = tilt;
  fibre.glint = glint;
  return fibre;
}

Fibre strand_fibre(uint strand, float along) {
  return fibre_of(strand_color(strand, along), u_tilt_spread * (2.0 * strand_random(strand, kSaltTilt) - 1.0),
                  mix(kGlintFrom, kGlintTo, strand_random(strand, kSaltGlint)));
}

// What stands for many strands: highlights are as wide as those of all of them together.
Fibre mean_fibre(float along) {
  Fibre fibre = fibre_of(mean_color(along), 0.0, 0.5 * (kGlintFrom + kGlintTo));
  // The variance of what is spread evenly is a third of its square.
  fibre.width = sqrt(fibre.width * fibre.width + u_tilt_spread * u_tilt_spread / 3.0);
  return fibre;
}

// What the strand scatters of a unit of light.
vec3 strand_scatter(vec3 tangent, vec3 to_light, vec3 to_eye, Fibre fibre) {
#if SHADING == SHADING_KAJIYA_KAY
  return scatter_kajiya_kay(tangent, to_light, to_eye, fibre);
#elif SHADING == SHADING_KARIS
  return scatter_karis(tangent, to_light, to_eye, fibre);
#elif SHADING == SHADING_CHIANG
  return scatter_chiang(tangent, to_light, to_eye, fibre);
#elif SHADING == SHADING_MARSCHNER
  return scatter_marschner(tangent, to_light, to_eye, fibre);
#else
  return scatter_sadeghi(tangent, to_light, to_eye, fibre);
#endif
}

#if SCATTERING == SCATTERING_ISOSURFACE
uniform sampler3D u_surface_density;      // strands crossed per metre, in the cells of the light volume
uniform float u_min_slope;        // change of it from cell to cell that makes a surface, per metre

const float kSurfaceWrap = 0.30;
// Weight of the diffuse term, which is as bright as that of single strands by it.
const float kSurfaceDiffuse = 1.10;

float density_at(vec3 at) { return texture(u_surface_density, at).r; }

vec3 hair_normal(vec3 point_m, vec3 fallback) {
  vec3 at = (point_m - u_volume_origin_m) * u_volume_from_m;
  vec3 cell = 1.0 / vec3(textureSize(u_surface_density, 0));
  vec3 x = vec3(cell.x, 0.0, 0.0);
  vec3 y = vec3(0.0, cell.y, 0.0);
  vec3 z = vec3(0.0, 0.0, cell.z);
  vec3 low = vec3(density_at(at - x), density_at(at - y), density_at(at - z));
  vec3 high = vec3(density_at(at + x), density_at(at + y), density_at(at + z));
  return density_normal(0.5 * (high - low), u_min_slope, fallback);
}
#endif

#if SCATTERING == SCATTERING_DUAL
const float kLeastLight = 1e-6;
#endif

// What of the light source goes to the eye: light_share of it gets through the hair to the strand.
vec3 strand_light_of_source(vec3 position_m, vec3 tangent, vec3 to_eye, Fibre fibre, float light_share) {
#if SCATTERING == SCATTERING_ISOSURFACE
  fibre.diffuse = 0.0;
  vec3 own = strand_scatter(tangent, u_to_light, to_eye, fibre);
  // Kajiya and Kay's normal: across the strand, towards the light.
  vec3 across = u_to_light - dot(tangent, u_to_light) * tangent;
  across = across / max(length(across), 1e-6);
  float diffuse = kSurfaceDiffuse * wrapped_diffuse(hair_normal(position_m, across), u_to_light, kSurfaceWrap);
  vec3 scattered = u_scatter * pow(max(light_share, 1e-6), kScatterReach) * fibre.color;
  return light_share * (own + diffuse * fibre.color) + scattered;
#elif SCATTERING == SCATTERING_DUAL
  fibre.diffuse = 0.0;
  vec3 own = strand_scatter(tangent, u_to_light, to_eye, fibre);
  ScatterAngles angles = scatter_angles(tangent, u_to_light, to_eye);
  angles.theta_half += fibre.tilt;
  // The volume tells which share has met no strand: exp of minus the mean number of them.
  float crossed = -log(max(light_share, kLeastLight));
  return dual_scattering(angles, fibre, own, crossed);
#elif SCATTERING == SCATTERING_NONE
  return light_share * strand_scatter(tangent, u_to_light, to_eye, fibre);
#else
  vec3 direct = strand_scatter(tangent, u_to_light, to_eye, fibre);
  vec3 scattered = u_scatter * pow(max(light_share, 1e-6), kScatterReach) * fibre.color;
  return light_share * direct + scattered;
#endif
}

vec3 fibre_light(vec3 position_m, vec3 tangent, Fibre fibre) {
  vec3 to_eye = normalize(u_eye_m - position_m);
  vec2 light = light_at(position_m);
  vec3 lit = strand_light_of_source(position_m, tangent, to_eye, fibre, light.x);
  // At the head's own middle there is no outward.
  float facing = 0.5 + 0.5 * dot(u_up, position_m / max(length(position_m), 1e-6));
  vec3 surrounding =
      u_ambient * mix(kGroundLight, 1.0, facing) * (kDeepLight + (1.0 - kDeepLight) * light.y) * fibre.color;
  return u_light_color * lit + surrounding;
}

vec3 strand_light(vec3 position_m, vec3 tangent, uint strand, float along) {
  return fibre_light(position_m, tangent, strand_fibre(strand, along));
}

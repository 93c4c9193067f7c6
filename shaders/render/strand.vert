// Strand pass: one quad per expanded segment, facing the camera, one pixel wider than the strand so that coverage
// fades out inside it. Four invocations per segment pull its two ends from the expanded buffer. Shaded here, per
// vertex: a strand is thinner than a pixel and its vertices are close.
#include "lib/hash.glsl"
#include "lib/strand_shading.glsl"
#include "render/light.glsl"
#include "shared/bindings.h"

struct ExpandedVertex {
  vec4 position_along;   // m, head space | 0 root .. 1 tip
  vec4 tangent_strand;   // unit | strand index as bits
};
layout(std430, binding = kBindingExpanded) restrict readonly buffer Expanded {
  ExpandedVertex vertex[];  // (segment_count x 2)
} expanded;

uniform mat4 u_clip_from_head;
uniform vec3 u_eye_m;             // head space
uniform vec2 u_target_px;
uniform float u_focal_px;         // pixels per metre at 1 m distance
uniform float u_strand_width_m;   // at the root
uniform float u_tip_scale;
uniform vec3 u_root_color;
uniform vec3 u_tip_color;
uniform float u_near_m;
uniform float u_widened_px;       // so that coverage fades out within the quad; 0: samples tell the edge
uniform int u_which;              // of all segments

const int kShallow = 1;
const int kDeep = 2;

noperspective out float v_across_px;   // from the strand's centre line
noperspective out float v_width_px;
flat out float v_threshold;            // of this strand
out vec3 v_color;

// Artist's weights of the terms, chosen by eye on the built-in scene.
const float kDiffuse = 0.70;
const float kScatter = 0.30;           // light that arrives through other strands
const float kScatterReach = 0.35;      // power of the direct part: how deep that light goes
const float kLobeR = 0.07;
const float kLobeTT = 0.25;
const float kLobeTRT = 1.10;
const float kGroundLight = 0.45;       // light from below over light from above
const float kDeepLight = 0.08;         // what is left of it in the middle of the hair, scattered many times
// Variation between strands.
const float kBrightnessSpread = 0.28;
const float kWarmthSpread = 0.08;
// Strands do not lie perfectly in their direction: the cuticle's tilt seems to vary.
const float kTiltSpread = 5.0 * kDegree;
const float kGlintFrom = 30.0 * kDegree;
const float kGlintTo = 45.0 * kDegree;
const uint kSaltBrightness = 0x68bc21ebu;
const uint kSaltWarmth = 0x02e5be93u;
const uint kSaltGlint = 0x967a889bu;
const uint kSaltTilt = 0x3c6ef372u;
const uint kSaltThreshold = 0x7f4a7c15u;

float strand_random(uint strand, uint salt) { return unit_float(mix_u32(strand ^ salt)); }

vec3 strand_color(uint strand, float along) {
  float brightness = 1.0 + kBrightnessSpread * (2.0 * strand_random(strand, kSaltBrightness) - 1.0);
  float warmth = kWarmthSpread * (2.0 * strand_random(strand, kSaltWarmth) - 1.0);
  vec3 color = mix(u_root_color, u_tip_color, along * along * (3.0 - 2.0 * along));
  return color * brightness * vec3(1.0 + warmth, 1.0, 1.0 - warmth);
}

vec3 shade(vec3 position_m, vec3 tangent, uint strand, float along) {
  vec3 to_eye = normalize(u_eye_m - position_m);
  vec3 color = strand_color(strand, along);
  vec2 light = light_at(position_m);
  ScatterAngles angles = scatter_angles(tangent, u_to_light, to_eye);
  angles.theta_half += kTiltSpread * (2.0 * strand_random(strand, kSaltTilt) - 1.0);
  vec3 lobes = sadeghi_lobes(angles, mix(kGlintFrom, kGlintTo, strand_random(strand, kSaltGlint)));

  // R leaves the surface and keeps the light's colour; TT and TRT went through the strand once and twice.
  vec3 through = sqrt(color);
  vec3 direct = kDiffuse * kajiya_kay_diffuse(tangent, u_to_light) * color + kLobeR * lobes.x +
                kLobeTT * lobes.y * through + kLobeTRT * lobes.z * color;
  vec3 scattered = kScatter * pow(max(light.x, 1e-6), kScatterReach) * color;
  float facing = 0.5 + 0.5 * dot(u_up, normalize(position_m));
  vec3 surrounding = u_ambient * mix(kGroundLight, 1.0, facing) * (kDeepLight + (1.0 - kDeepLight) * light.y) * color;
  return u_light_color * (light.x * direct + scattered) + surrounding;
}

void main() {
  uint segment = uint(gl_VertexID) >> 2;
  uint end = uint(gl_VertexID >> 1) & 1u;
  float side = float(gl_VertexID & 1) * 2.0 - 1.0;
  ExpandedVertex v = expanded.vertex[2u * segment + end];
  vec3 position_m = v.position_along.xyz;
  vec3 tangent = v.tangent_strand.xyz;
  uint strand = floatBitsToUint(v.tangent_strand.w);
  uint is_deep = strand >> 31;   // of sample_choice.comp
  strand &= 0x7fffffffu;
  if (u_which == kShallow && is_deep == 1u || u_which == kDeep && is_deep == 0u) {
    gl_Position = vec4(0.0, 0.0, 2.0, 1.0);   // all corners in one place, and that not seen
    return;
  }
  float along = v.position_along.w;

  vec4 clip = u_clip_from_head * vec4(position_m, 1.0);
  vec4 clip_step = u_clip_from_head * vec4(tangent, 0.0);
  // Direction on the screen, up to a positive factor. A strand that points at the eye has none: any will do.
  vec2 direction = (clip_step.xy * clip.w - clip.xy * clip_step.w) * u_target_px;
  float direction_length = length(direction);
  vec2 across = direction_length > 1e-12 ? vec2(-direction.y, direction.x) / direction_length : vec2(1.0, 0.0);

  float distance_m = max(clip.w, u_near_m);
  v_width_px = u_strand_width_m * mix(1.0, u_tip_scale, along * along) * u_focal_px / distance_m;
  v_across_px = side * 0.5 * max(v_width_px + u_widened_px, 1.0);
  clip.xy += across * v_across_px * (2.0 / u_target_px) * distance_m;
  gl_Position = clip;
  v_threshold = strand_random(strand, kSaltThreshold);
  v_color = shade(position_m, tangent, strand, along);
}

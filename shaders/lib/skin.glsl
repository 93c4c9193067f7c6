// Light that skin sends to the eye: it wraps around the terminator, has a soft highlight, and lies in the hair's shadow.
// Also compiled for the CPU, over lanes (common/simd).
#pragma once
#include "lib/hair_light.glsl"
#include "lib/select.glsl"

// `cover`: 0 bare skin .. 1 under hair.
LAW vec3 skin_radiance(vec3 skin_color, vec3 root_color, HairLights lights, LightDepth depth, vec3 normal, vec3 to_eye,
                   float cover) {
  // Light scattered inside skin reaches past the terminator, red furthest (Green 2004, wrap lighting).
  const vec3 kWrap = vec3(0.12, 0.05, 0.03);
  // Roots that are not drawn tint the skin between those that are; where hair parts, skin shines.
  const float kScalpTint = 0.30;
  const float kShine = 0.10;
  const float kGroundLight = 0.45;
  const float kSkyReach = 0.18;
  const float kSkyFloor = 0.30;
  const float kSeepReach = 0.15;  // light that seeps through hair onto skin, as scattered as within it
  const float kSeep = 0.02;
  // Faces turned away are seen only where the mesh is open; lit as if turned here.
  vec3 outward = select(dot(normal, to_eye) < -0.2, -normal, normal);
  float tint = kScalpTint * clamp(cover, 0.0, 1.0);
  vec3 skin = mix(skin_color, root_color, tint);

  float key_facing = dot(outward, lights.to_key);
  float rim_facing = dot(outward, lights.to_rim);
  vec3 key = max((vec3(key_facing) + kWrap) / (vec3(1.0) + kWrap), vec3(0.0)) * skin;
  vec3 rim = max((vec3(rim_facing) + kWrap) / (vec3(1.0) + kWrap), vec3(0.0)) * skin;
  // (n.h)^16
  float h = max(dot(outward, normalize(lights.to_key + to_eye)), 0.0);
  float h2 = h * h;
  float h4 = h2 * h2;
  float h8 = h4 * h4;
  float shine = (1.0 - tint) * kShine * h8 * h8 * select(key_facing > 0.0, 1.0, 0.0);
  float sky = lights.ambient * mix(kGroundLight, 1.0, 0.5 + 0.5 * dot(outward, lights.up)) *
              mix(kSkyFloor, 1.0, exp(-kSkyReach * depth.sky));
  return lights.key_color * (exp(-depth.key) * (key + vec3(shine)) + kSeep * exp(-kSeepReach * depth.key) * skin) + lights.rim_color * (exp(-depth.rim) * rim) +
         skin * sky;
}

// Light that a strand sends to the eye. The lobes are the fits of Karis 2016 (Physically based hair shading in Unreal) to
// Marschner et al. 2003: R from the surface, TT through the strand, TRT back from its far side; the light that comes
// through other strands falls more slowly than the direct light. No inverse trigonometry, no branches: also compiled
// for the CPU, over lanes (common/simd). Directions are unit vectors away from the strand.
#pragma once
#include "lib/hash.glsl"
#include "lib/select.glsl"

// Of the scene: weights of the terms, and how strands differ.
// schema begin: shader look
struct HairLook {
  vec3 root_color;
  vec3 tip_color;
  float diffuse;
  float scatter;  // light that comes through other strands
  float highlight;  // R: the light's colour, from the surface
  float transmission;  // TT, seen against the light
  float second_highlight;  // TRT: coloured, nearer to the root
  float width;  // rad
  float tilt;  // tilt of the scales: moves the highlights apart, rad
  float tilt_spread;  // from strand to strand, rad
  float root_darkening;  // 0..1, over the first quarter of a strand
  float strand_variation;  // 0..1, of brightness from strand to strand
  float lock_variation;  // from lock to lock
  float warmth_variation;  // 0..1, of red against blue
  float wetness;  // 0 dry .. 1 dripping: darker, clumped, sharp highlights
};
// schema end

// What one strand is like, all along.
struct HairStrand {
  float brightness;
  float warmth;
  float tilt;    // beside that of all, rad
};

// Where light comes from, as the light volume has it.
struct HairLights {
  vec3 to_key;
  vec3 key_color;
  vec3 to_rim;
  vec3 rim_color;
  bool has_rim;
  vec3 up;
  float ambient;
};

// Optical depth between a point and the key light, the rim light and the sky.
struct LightDepth {
  float key;
  float rim;
  float sky;
};

const uint kSaltBrightness = 0x68bc21ebu;
const uint kSaltWarmth = 0x02e5be93u;
const uint kSaltTilt = 0x3c6ef372u;

LAW HairStrand hair_strand(uint strand, uint lock, HairLook look) {
  float mine = 2.0 * unit_float(mix_u32(strand ^ kSaltBrightness)) - 1.0;
  float shared_by_lock = 2.0 * unit_float(mix_u32(lock ^ kSaltBrightness)) - 1.0;
  HairStrand hair;
  hair.brightness = (1.0 + look.strand_variation * mine) * (1.0 + look.lock_variation * shared_by_lock);
  hair.warmth = look.warmth_variation * (2.0 * unit_float(mix_u32(strand ^ kSaltWarmth)) - 1.0);
  hair.tilt = look.tilt_spread * (2.0 * unit_float(mix_u32(strand ^ kSaltTilt)) - 1.0);
  return hair;
}

LAW vec3 hair_color(HairLook look, HairStrand hair, float along) {
  const float kDarkRoots = 0.25;  // of the length
  float blend = along * along * (3.0 - 2.0 * along);
  float dark = 1.0 - look.root_darkening * (1.0 - min(along / kDarkRoots, 1.0));
  // Water between the scales takes light out (Jensen et al. 1999): wet hair is darker and fuller in colour.
  float wet = 1.0 - 0.45 * look.wetness;
  vec3 color = mix(look.root_color, look.tip_color, blend) * (hair.brightness * dark * wet);
  return clamp(color * vec3(1.0 + hair.warmth, 1.0, 1.0 - hair.warmth), 0.0, 1.0);
}

// Light of one lamp that leaves towards the eye, per unit of light: direct terms only.
LAW vec3 hair_lobes(HairLook look, float tilt, vec3 color, vec3 tangent, vec3 to_light, vec3 to_eye) {
  const float kNorm = 0.39894228;       // of a unit Gaussian
  const float kFresnel = 0.0465;        // at normal incidence, index 1.55
  float sin_in = clamp(dot(tangent, to_light), -1.0, 1.0);
  float sin_out = clamp(dot(tangent, to_eye), -1.0, 1.0);
  float cos_in = sqrt(max(1.0 - sin_in * sin_in, 1e-4));
  float cos_out = sqrt(max(1.0 - sin_out * sin_out, 1e-4));
  float cos_phi = clamp((dot(to_light, to_eye) - sin_in * sin_out) / (cos_in * cos_out), -1.0, 1.0);
  float cos_half = sqrt(max(0.5 + 0.5 * cos_phi, 0.0));

  // Longitudinal: Gaussians of the sum of sines, shifted by the tilt of the scales (Karis 2016).
  float dry = 1.0 - 0.5 * look.wetness;
  float width_r = 2.0 * look.width * dry;
  float width_tt = 0.5 * width_r;
  float width_trt = 2.0 * width_r;
  float sum = sin_in + sin_out;
  float r = (sum + 2.0 * tilt) / width_r;
  float tt = (sum - tilt) / width_tt;
  float trt = (sum - 4.0 * tilt) / width_trt;
  float m_r = exp(-0.5 * r * r) * kNorm / width_r;
  float m_tt = exp(-0.5 * tt * tt) * kNorm / width_tt;
  float m_trt = exp(-0.5 * trt * trt) * kNorm / width_trt;

  // Azimuthal.
  float graze = 1.0 - sqrt(clamp(0.5 + 0.5 * dot(to_light, to_eye), 0.0, 1.0));
  float graze2 = graze * graze;
  float n_r = 0.25 * cos_half * (kFresnel + (1.0 - kFresnel) * graze2 * graze2 * graze);
  float n_tt = exp(-3.65 * cos_phi - 3.98);
  float n_trt = exp(17.0 * cos_phi - 16.78) + 0.12 * cos_half;

  // R keeps the light's colour; TT and TRT went through the strand once and twice.
  const float kPi = 3.14159265;
  const float kBright = 2.2;      // by eye, beside the diffuse term
  const float kTrtShare = 0.35;
  float sharp = 1.0 + look.wetness;
  float highlight = kBright * kPi * sharp * look.highlight * m_r * n_r;
  vec3 through = sqrt(color);
  float transmitted = kBright * look.transmission * m_tt * n_tt;
  float second = kBright * kTrtShare * kPi * look.second_highlight * m_trt * n_trt;
  // Between the fibre's own facing and that of the tuft it lies in.
  vec3 across = to_eye - tangent * sin_out;
  float facing = 0.5 + 0.5 * dot(across, to_light) / cos_out;
  float diffuse = look.diffuse * (1.0 - 0.5 * look.wetness) * (0.55 * cos_in + 0.45 * facing);
  return vec3(highlight) + through * transmitted + color * (second + diffuse);
}

// Of all that reaches a point of a strand.
LAW vec3 hair_radiance(HairLook look, HairStrand hair, HairLights lights, LightDepth depth, float along, vec3 tangent,
                   vec3 to_eye) {
  // Light scattered forward by other strands goes on: its depth counts less, and never all is lost (Zinke et al. 2008
  // give the reason; the numbers are by eye, against pictures of 96^3 volumes).
  const float kScatterReach = 0.28;
  const float kScatterFloor = 0.05;
  const float kSkyReach = 0.14;
  const float kSkyFloor = 0.15;
  const float kGroundLight = 0.35;
  const float kSkySheen = 0.06;  // what the surfaces of strands send on of the sky, in its own colour
  vec3 color = hair_color(look, hair, along);
  float tilt = look.tilt + hair.tilt;
  vec3 scattered_color = color * sqrt(color) * look.scatter;

  vec3 key = exp(-depth.key) * hair_lobes(look, tilt, color, tangent, lights.to_key, to_eye) +
             mix(kScatterFloor, 1.0, exp(-kScatterReach * depth.key)) * scattered_color;
  vec3 rim = vec3(0.0);
  if (lights.has_rim)
    rim = exp(-depth.rim) * hair_lobes(look, tilt, color, tangent, lights.to_rim, to_eye) +
          mix(kScatterFloor, 1.0, exp(-kScatterReach * depth.rim)) * scattered_color;
  vec3 across = to_eye - tangent * dot(tangent, to_eye);
  float facing = 0.5 + 0.5 * dot(across, lights.up);
  float open_sky = mix(kSkyFloor, 1.0, exp(-kSkyReach * depth.sky));
  float sky = lights.ambient * mix(kGroundLight, 1.0, facing) * open_sky;
  return lights.key_color * key + lights.rim_color * rim + (color + vec3(kSkySheen)) * sky;
}

// How much of its width a strand covers at `along`: it comes out of the skin over its first part and fades out over its
// last. `step`: from point to point; where that is longer than the first part, as much is missing in all. 0 fade: never.
LAW float strand_cover(float along, float step, float fade) {
  const float kRootFade = 0.03;  // of the length
  const float kRootCover = 0.15;
  float buried = max(1.0 - along / kRootFade, 0.0) * min(kRootFade / max(step, 1e-6), 1.0);
  return clamp((1.0 - along) / max(fade, 1e-3) + 0.1, 0.0, 1.0) * (1.0 - (1.0 - kRootCover) * buried);
}

// Light that a strand sends to the eye: R from its surface, TT through it, TRT back from its far side, with the shapes of
// d'Eon et al. 2011 along it and of Karis 2016 (Physically based hair shading in Unreal) across, and the energy of Chiang
// et al. 2016 for its colour; and light that other strands sent on (Zinke et al. 2008). No inverse trigonometry, no
// branches: also compiled for the CPU, over lanes (common/simd). Directions are unit vectors away from the strand.
#pragma once
#include "lib/hash.glsl"
#include "lib/select.glsl"

#ifndef __cplusplus
// A relative error of 1e-4 is not seen.
#define light_exp(x) exp(x)
#define light_log2(x) log2(x)
#endif

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
  const float kRootShare = 0.3;   // of the darkening; shadow does the rest
  float blend = along * along * (3.0 - 2.0 * along);
  float dark = 1.0 - kRootShare * look.root_darkening * (1.0 - min(along / kDarkRoots, 1.0));
  vec3 color = mix(look.root_color, look.tip_color, blend) * (hair.brightness * dark);
  return clamp(color * vec3(1.0 + hair.warmth, 1.0, 1.0 - hair.warmth), 0.0, 1.0);
}

// What a strand does with the light that falls on it, by its colour.
struct StrandShares {
  vec3 through;   // TT
  vec3 returned;  // TRT
  vec3 backward;  // all that goes back to where it came from
  vec3 around;    // comes back from the strands behind, after any number of ways
};

LAW StrandShares strand_shares(vec3 color, float wetness) {
  // Absorption from colour as Chiang et al. 2016 have it for azimuthal roughness 0.3. The exponent makes the shares those
  // of their fibre; light that is returned has gone through twice.
  const float kPerLog2 = 0.69314718 / 5.8884;
  const float kAbsorbed = 1.87;
  const float kThrough = 0.85;
  const float kReturned = 0.067;
  // Under water the index changes by 1.165 instead of 1.55: less is reflected within and at the surface (Fresnel).
  const float kReturnedWet = 0.2;
  const float kSurface = 0.050;
  const float kSurfaceWet = 0.022;
  const float kLeastColor = 1e-3;
  vec3 least = max(color, vec3(kLeastColor));
  vec3 root = kPerLog2 * vec3(light_log2(least.x), light_log2(least.y), light_log2(least.z));
  vec3 passed = light_exp(-kAbsorbed * root * root);
  StrandShares shares;
  shares.through = kThrough * passed;
  shares.returned = (kReturned * mix(1.0, kReturnedWet, wetness)) * passed * passed;
  shares.backward = shares.returned + vec3(mix(kSurface, kSurfaceWet, wetness));
  // Zinke et al. 2008, equations 13 to 15: one and three ways back.
  vec3 twice = shares.through * shares.through;
  vec3 lost = vec3(1.0) / (vec3(1.0) - twice);
  vec3 once = shares.backward * twice * lost;
  vec3 turned = shares.backward * lost;
  shares.around = once * (vec3(1.0) + turned * turned);
  return shares;
}

// How a strand lies between light and eye.
struct StrandAngles {
  float sin_in;   // of the light's inclination
  float cos_in;
  float sin_out;  // of the eye's
  float cos_out;
  float cos_phi;  // of the azimuth between both
  float facing;   // 0 away from the light .. 1 towards it, across the strand
};

LAW StrandAngles strand_angles(vec3 tangent, vec3 to_light, vec3 to_eye) {
  StrandAngles angles;
  angles.sin_in = clamp(dot(tangent, to_light), -1.0, 1.0);
  angles.sin_out = clamp(dot(tangent, to_eye), -1.0, 1.0);
  angles.cos_in = sqrt(max(1.0 - angles.sin_in * angles.sin_in, 1e-4));
  angles.cos_out = sqrt(max(1.0 - angles.sin_out * angles.sin_out, 1e-4));
  float across = dot(to_light, to_eye) - angles.sin_in * angles.sin_out;
  angles.cos_phi = clamp(across / (angles.cos_in * angles.cos_out), -1.0, 1.0);
  angles.facing = 0.5 + 0.5 * across / angles.cos_out;
  return angles;
}

// The longitudinal law of d'Eon et al. 2011, equation 7, as a height times an exponential. Along a strand it is narrow and
// high, where a Gaussian of sines would be too dark.
struct Cone {
  float height;
  float exponent;
};

// Of light that is turned by `tilt` rad, which is small. The root stands for I0(x) exp(-x), x = cosines / variance, and is
// within 7 % of it.
LAW Cone light_cone(StrandAngles angles, float tilt, float variance) {
  const float kTwoPi = 6.2831853;
  float cos_tilt = 1.0 - 0.5 * tilt * tilt;
  float cosines = abs(angles.cos_in * cos_tilt - angles.sin_in * tilt) * angles.cos_out;
  float sines = (angles.sin_in * cos_tilt + angles.cos_in * tilt) * angles.sin_out;
  float per_variance = 1.0 / variance;
  Cone cone;
  cone.height = inversesqrt(variance * max(variance + 2.6 * cosines, kTwoPi * cosines - 1.6 * variance));
  cone.exponent = (cosines - sines - 1.0) * per_variance;
  return cone;
}

// Light of one lamp that leaves towards the eye, per unit of light. Where all weights of the look are 1, no more leaves in
// all directions than came.
LAW vec3 hair_lobes(HairLook look, float tilt, StrandShares shares, StrandAngles angles, float cos_light_eye) {
  const float kPi = 3.14159265;
  float width = 2.0 * look.width * (1.0 - 0.5 * look.wetness);
  float variance = width * width;
  Cone cone_r = light_cone(angles, 2.0 * tilt, variance);
  Cone cone_tt = light_cone(angles, -tilt, 0.25 * variance);
  Cone cone_trt = light_cone(angles, -4.0 * tilt, 4.0 * variance);

  // Azimuthal; those of TT and TRT have area 1.
  const float kFresnel = 0.0465;     // at normal incidence, index 1.55
  const float kFresnelWet = 0.0201;  // of water's surface, index 1.33
  const float kMirror = 0.30;        // 1/4, and what Schlick's law leaves out at middle angles
  float fresnel = mix(kFresnel, kFresnelWet, look.wetness);
  float graze = 1.0 - sqrt(clamp(0.5 + 0.5 * cos_light_eye, 0.0, 1.0));
  float graze2 = graze * graze;
  float n_r = kMirror * sqrt(max(0.5 + 0.5 * angles.cos_phi, 0.0)) * (fresnel + (1.0 - fresnel) * graze2 * graze2 * graze);
  float r = look.highlight * cone_r.height * n_r * light_exp(cone_r.exponent);
  float tt = look.transmission * cone_tt.height * light_exp(cone_tt.exponent - 3.65 * angles.cos_phi - 3.98);
  float trt = look.second_highlight * cone_trt.height * light_exp(cone_trt.exponent + 11.5 * angles.cos_phi - 11.209);

  // What the surface reflects does not enter; more where light comes along the strand. And wide lobes of such light would
  // give back more than it gets.
  float into = 1.0 - 0.8 * angles.cos_in;
  float into2 = into * into;
  float entering = 1.0 - into2 * into2 * into;
  float energy = min(angles.cos_in / angles.cos_out, 1.0);
  return (kPi * energy) * (vec3(r) + (entering * entering) * (shares.through * tt + shares.returned * trt));
}

// Likewise, with what comes to the strand through others. `depth`: as the lattices have it.
LAW vec3 hair_lit(HairLook look, float tilt, StrandShares shares, vec3 tangent, vec3 to_light, vec3 to_eye, float depth) {
  const float kCrossedPerDepth = 1.25;
  // Of scattered light: how wide its lobe is at the surface and how it widens on its way, and what goes on and comes back.
  const float kWide2 = 0.04;
  const float kWiden2 = 0.86;
  const float kMostCrossed = 8.0;
  const float kOnward = 1.8;
  const float kBack = 6.8;
  StrandAngles angles = strand_angles(tangent, to_light, to_eye);
  float crossed = kCrossedPerDepth * depth;
  float direct = light_exp(-crossed);
  // Each strand passed on the way has let through its share, colour by colour.
  vec3 indirect = max(light_exp(-crossed * (vec3(1.0) - shares.through)) - vec3(direct), vec3(0.0));
  vec3 around = shares.around * (look.diffuse * 2.0 * angles.facing * angles.cos_in);
  Cone cone = light_cone(angles, -tilt, kWide2 + kWiden2 * min(crossed, kMostCrossed));
  float m = cone.height * light_exp(cone.exponent);
  float back = 0.5 + 0.5 * angles.cos_phi;
  vec3 spread = (look.scatter * m) * (shares.through * (kOnward * (1.0 - back)) + shares.backward * (kBack * back));
  return direct * (hair_lobes(look, tilt, shares, angles, dot(to_light, to_eye)) + around) + indirect * (spread + around);
}

// Depth in front of a strand that is seen. `own`: what a lattice finds within the strand's own lock, of which the strands
// that are seen have less in front of them than those behind.
LAW float depth_of_seen(float depth, float own) { return depth * depth / (depth + own); }

LAW float key_depth_of_seen(float depth) {
  const float kOwn = 0.5;
  const float kShare = 1.17;  // keeps depths of about 3 as they are
  return kShare * depth_of_seen(depth, kOwn);
}

// Likewise; this lattice is twice as coarse.
LAW float rim_depth_of_seen(float depth) {
  const float kOwn = 1.5;
  const float kShare = 1.15;
  return kShare * depth_of_seen(depth, kOwn);
}

// Of all that reaches a point of a strand.
LAW vec3 hair_radiance(HairLook look, HairStrand hair, HairLights lights, LightDepth depth, float along, vec3 tangent,
                   vec3 to_eye) {
  const vec3 kBySkin = vec3(1.06, 0.985, 0.965);  // some light comes by way of skin, which sends back red
  const float kGroundLight = 0.52;
  const float kSkyReach = 0.55;
  // Of the sky: hair's colour, brighter where it is dark, and a sheen in the sky's own colour. It grows where one looks
  // along the strand, as what a surface reflects does.
  const float kSkyColor = 2.5;
  const float kSkyFull = 1.5;
  const float kSkyWet = 0.55;
  const float kSkySheen = 0.16;
  const float kSkyAlong = 2.0;
  const float kMostSheen = 0.9;
  const float kSheenReach = 0.48;
  vec3 color = hair_color(look, hair, along);
  StrandShares shares = strand_shares(color, look.wetness);
  float tilt = look.tilt + hair.tilt;
  vec3 key = hair_lit(look, tilt, shares, tangent, lights.to_key, to_eye, key_depth_of_seen(depth.key));
  vec3 rim = vec3(0.0);
  if (lights.has_rim) rim = hair_lit(look, tilt, shares, tangent, lights.to_rim, to_eye, rim_depth_of_seen(depth.rim));
  vec3 across = to_eye - tangent * dot(tangent, to_eye);
  vec3 body = (kSkyColor * mix(1.0, kSkyWet, look.wetness)) * color / (vec3(1.0) + kSkyFull * color);
  float facing = 0.5 + 0.5 * dot(across, lights.up);
  float along_eye = 1.0 - sqrt(min(dot(across, across), 1.0));
  float more_sheen = min(kSkyAlong * along_eye * along_eye, kMostSheen - kSkySheen);
  vec3 sky = light_exp(-(kSkyReach * depth.sky) * (vec3(1.0) - shares.through)) * (1.0 - more_sheen) * body +
             ((kSkySheen + more_sheen) * light_exp(-kSheenReach * depth.sky)) * (vec3(1.0) - color);
  vec3 light = lights.key_color * key + lights.rim_color * rim + (lights.ambient * mix(kGroundLight, 1.0, facing)) * sky;
  return kBySkin * light;
}

// How much of its width a strand covers at `along`: it comes out of the skin over its first part and fades out over its
// last. `step`: from point to point; where that is longer than the first part, as much is missing in all. 0 fade: never.
LAW float strand_cover(float along, float step, float fade) {
  const float kRootFade = 0.03;  // of the length
  const float kRootCover = 0.15;
  float buried = max(1.0 - along / kRootFade, 0.0) * min(kRootFade / max(step, 1e-6), 1.0);
  return clamp((1.0 - along) / max(fade, 1e-3) + 0.1, 0.0, 1.0) * (1.0 - (1.0 - kRootCover) * buried);
}

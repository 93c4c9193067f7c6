// How a drawn strand lies between and beside the simulated ones: locks that draw together towards the tip, waves that a
// lock shares, frizz of its own, strays and broken strands. Nothing moves a root, everything grows with the way from
// it. All randomness is an integer hash of the strand's index. Also compiled for the CPU, over lanes (common/simd).
#pragma once
#include "lib/hash.glsl"
#include "lib/hermite.glsl"
#include "lib/select.glsl"

// Of the scene; lengths in m, counts per strand, all else shares.
struct StrandStyle {
  float clump;
  float locks;          // per root triangle
  float spread_m;
  float wave_m;
  float wave_count;
  float frizz_m;
  float frizz_count;
  float stray_share;
  float stray_spread;
  float length_spread;
  float short_share;
};

// What is the same all along one drawn strand.
struct DrawnStrand {
  vec3 weights;       // of three keys at the root, sum 1
  vec3 lock_weights;  // of its lock's middle
  float pull;         // towards the lock, 0..1
  float end;          // how much of the keys' length it has, 0..1
  float amplitude;    // of what sets it apart
  vec3 direction;     // it strays there, each part -1..1
  float phase;        // of its own waves, in turns
  float lock_phase;   // of its lock's waves
};

const float kTau = 6.28318530718;
// Salts that make independent numbers of one index.
const uint kSaltFirst = 0x9e3779b9u;
const uint kSaltSecond = 0x85ebca6bu;
const uint kSaltLength = 0xc2b2ae35u;
const uint kSaltX = 0x27d4eb2fu;
const uint kSaltY = 0x165667b1u;
const uint kSaltZ = 0xd3a2646cu;
const uint kSaltPhase = 0xfd7046c5u;
const uint kSaltStray = 0x1b873593u;
const uint kSaltShort = 0xcc9e2d51u;
const uint kSaltCut = 0x6c62272eu;
const uint kSaltAmplitude = 0x4f1bbcdcu;
const uint kSaltLock = 0x38b34ae5u;

LAW float style_random(uint index, uint salt) { return unit_float(mix_u32(index ^ salt)); }

// Uniformly spread barycentric weights (sum 1, each >= 0).
LAW vec3 spread_weights(uint index) {
  float root = sqrt(style_random(index, kSaltFirst));
  float second = style_random(index, kSaltSecond);
  return vec3(1.0 - root, root * (1.0 - second), root * second);
}

// The lock of a follower, an index that the triangle's others share.
LAW uint lock_of(uint follower, uint triangle, float locks) {
  float which = floor(style_random(follower, kSaltLock) * locks);
  return mix_u32(triangle ^ kSaltLock) ^ uint(which);
}

// A strand is as long as its keys, or a little shorter, or broken.
LAW float strand_end(uint strand, StrandStyle style) {
  const float kBroken = 0.4;  // most that a broken one lacks
  float less = style_random(strand, kSaltLength);
  float broken = select(style_random(strand, kSaltShort) < style.short_share, kBroken * style_random(strand, kSaltCut), 0.0);
  return max(1.0 - style.length_spread * less * less - broken, 0.3);
}

// `strand`: its index among all drawn ones. `weights`, `lock_weights`: all on the first key for a key strand.
LAW DrawnStrand drawn_strand(uint strand, uint lock, vec3 weights, vec3 lock_weights, StrandStyle style) {
  const float kStrayPull = 0.25;
  float is_stray = select(style_random(strand, kSaltStray) < style.stray_share, 1.0, 0.0);
  DrawnStrand drawn;
  drawn.weights = weights;
  drawn.lock_weights = lock_weights;
  drawn.pull = style.clump * mix(1.0, kStrayPull, is_stray);
  drawn.end = strand_end(strand, style);
  drawn.amplitude = mix(0.5 + style_random(strand, kSaltAmplitude), style.stray_spread, is_stray);
  drawn.direction = 2.0 * vec3(style_random(strand, kSaltX), style_random(strand, kSaltY), style_random(strand, kSaltZ)) - 1.0;
  drawn.phase = style_random(strand, kSaltPhase);
  drawn.lock_phase = style_random(lock, kSaltPhase);
  return drawn;
}

// Rises from 0 at `from` to 1 at `to`, smoothly.
LAW float rising(float from, float to, float x) {
  float t = clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

// Weights of the three keys at `along`, 0 at the root and 1 at the tip of this strand.
LAW vec3 weights_at(DrawnStrand drawn, float along) {
  return mix(drawn.weights, drawn.lock_weights, drawn.pull * rising(0.08, 0.85, along));
}

// What sets a strand apart from its keys at `along`, m. `tangent`: theirs, any length.
LAW vec3 deviation_m(DrawnStrand drawn, StrandStyle style, float along, vec3 tangent) {
  const float kBends = 2.5;  // of the way it strays
  const vec3 kAxis = vec3(0.3, 0.2, 0.93);
  float wave = sin(kTau * (kBends * along + drawn.phase)) - sin(kTau * drawn.phase);
  float stray_m = drawn.amplitude * style.spread_m * along * rising(0.05, 0.6, along);
  vec3 sum = stray_m * (drawn.direction + 0.35 * wave * vec3(drawn.direction.y, drawn.direction.z, drawn.direction.x));

  vec3 along_keys = unit_or(tangent, vec3(0.0, -1.0, 0.0));
  vec3 one = unit_or(cross(along_keys, kAxis), vec3(1.0, 0.0, 0.0));
  vec3 other = cross(along_keys, one);
  float wave_m = style.wave_m * along * rising(0.15, 0.7, along);
  float turn = kTau * (style.wave_count * along + drawn.lock_phase);
  sum += wave_m * (sin(turn) * one + cos(0.87 * turn) * other);
  float frizz_m = style.frizz_m * drawn.amplitude * rising(0.1, 0.8, along);
  float small_turn = kTau * (style.frizz_count * along + drawn.phase);
  return sum + frizz_m * (sin(small_turn) * other + cos(0.81 * small_turn + 2.0) * one);
}

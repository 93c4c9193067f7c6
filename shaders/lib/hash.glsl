// Integer hash, bit for bit the same as common/base/hash.h (a GL test compares the two).
#pragma once
#include "lib/select.glsl"

// Well-mixed 32-bit hash of one integer (the lowbias32 finaliser by Chris Wellons, public domain).
LAW uint mix_u32(uint x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  x ^= x >> 16;
  return x;
}

// Uniform number in [0, 1) from a hash, exact in float (24 bits).
LAW float unit_float(uint hash) { return float(hash >> 8) * (1.0 / 16777216.0); }

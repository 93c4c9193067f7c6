// The formulas of shaders/lib as C++ over lanes, compiled from the same text as the shaders. Include it only
// in files with kernels (common/simd/variants.h), into which everything is inlined.
#pragma once

#include "common/simd/lanes.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-variable"
namespace strandcast::law {
namespace {
using namespace simd;  // NOLINT: the laws are written in GLSL's names

/// e^x with a relative error below 1e-4, for x up to 60; what is below -86 counts as that.
STRANDCAST_LANES Float light_exp(Float x) {
  constexpr float kRounder = 12582912.0f;  // 1.5 * 2^23: a number added to it is rounded to an integer
  const Float y = max(x, -86.0f) * 1.44269504f;
  const Float rounded = y + kRounder;
  const Float f = y - (rounded - kRounder);
  // 2^f for |f| <= 1/2, of the least largest relative error (Remez).
  const Float p = 0.999928074f + f * (0.693260985f + f * (0.242611122f + f * 0.0551716691f));
  return (FloatBits)((UintBits)p.v + ((UintBits)rounded.v << 23));
}
STRANDCAST_LANES vec3 light_exp(vec3 x) {
  return {light_exp(x.x), light_exp(x.y), light_exp(x.z)};
}
/// Base-2 logarithm of positive numbers with an error below 2e-5.
STRANDCAST_LANES Float light_log2(Float x) {
  constexpr uint32_t kRootOfHalf = 0x3f3504f3u;
  const UintBits from = (UintBits)x.v - kRootOfHalf;
  const Float whole = __builtin_convertvector((IntBits)from >> 23, FloatBits);
  const Float y = Float((FloatBits)((from & 0x7fffffu) + kRootOfHalf)) - 1.0f;
  // log2(1 + y) / y where 1 + y is between the root of a half and that of two (Remez).
  return whole + y * (1.44257801f +
                      y * (-0.720241803f + y * (0.486686149f + y * (-0.394575370f + y * 0.252660290f))));
}

#define LAW STRANDCAST_LANES
#define float Float
#define uint Uint
#include "shaders/lib/coverage.glsl"
#include "shaders/lib/hair_light.glsl"
#include "shaders/lib/hash.glsl"
#include "shaders/lib/hermite.glsl"
#include "shaders/lib/skin.glsl"
#include "shaders/lib/strand_style.glsl"
#undef uint
#undef float
#undef LAW
}  // namespace
}  // namespace strandcast::law
#pragma GCC diagnostic pop

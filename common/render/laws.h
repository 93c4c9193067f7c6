// The formulas of shaders/lib as C++ over lanes, compiled from the same text as the shaders. Include it only
// in files with kernels (common/simd/variants.h), into which everything is inlined.
#pragma once

#include "common/simd/lanes.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-variable"
namespace strandcast::law {
namespace {
using namespace simd;  // NOLINT: the laws are written in GLSL's names
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

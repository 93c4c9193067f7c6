// Interpolates coordinates between states, eight at a time: linearly between two or on the cubic through
// four. Each coordinate is independent; all instruction sets give the same bits.
#pragma once

#include <array>
#include <cstddef>

#include "common/simd/variants.h"

namespace strandcast {

struct LineBlend {
  const float* from = nullptr;  // (count), as are all below
  const float* to = nullptr;
  float* out = nullptr;
  size_t count = 0;
  float blend = 0.0f;  // 0 gives from
};
/// Computes out = from + blend (to - from).
void blend_on_line(simd::InstructionSet set, const LineBlend& of);

struct CubicBlend {
  std::array<const float*, 4> state{};  // (count) each, in the order of time
  float* out = nullptr;
  size_t count = 0;
  // As in CubicTerms (common/replay/interpolation.h).
  float blend = 0.0f;
  float before_scale = 0.0f;
  float after_scale = 0.0f;
  float bend_before = 0.0f;
  float bend_after = 0.0f;
};
/// Evaluates CubicTerms, but linearly where a coordinate jumps: one of its three steps exceeds kJumpSteps
/// times the sum of the other two. So beside a jump the cubic overshoots the states by at most half a usual
/// step.
void blend_on_cubic(simd::InstructionSet set, const CubicBlend& of);

/// Ratio above which a step is a jump. On recorded hair, including wild clips, 1 % of coordinates jump;
/// treating them linearly adds at most 1.5 % to the error.
inline constexpr float kJumpSteps = 8.0f;

}  // namespace strandcast

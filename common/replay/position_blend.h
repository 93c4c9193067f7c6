// Coordinates between states, eight at a time: on the line between two states or on the cubic through four.
// Every coordinate by itself, the same bits from every instruction set.
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
/// out = from + blend (to - from).
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
/// What CubicTerms says, and the line alone where a coordinate jumps: where one of its three steps is more
/// than kJumpSteps times the other two together. So the cubic leaves the states by no more than half a usual
/// step beside a jump.
void blend_on_cubic(simd::InstructionSet set, const CubicBlend& of);

/// A step of more than this many times the other two together is a jump. On recorded hair, wild clips too,
/// 1 % of coordinates take one, and it adds no more than 1.5 % to the error.
inline constexpr float kJumpSteps = 8.0f;

}  // namespace strandcast

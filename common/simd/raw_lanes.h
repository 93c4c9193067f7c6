// Raw lanes: eight floats or integers side by side for the strand codecs. Unlike in common/simd/lanes.h,
// comparisons give integer masks and ?: selects by them. Integers wrap around only in the functions that say
// so. Every lane computes what a scalar would, in the same order and without contraction, so all instruction
// sets give the same bits. Everything is inline; instruction sets are chosen by common/simd/variants.h.
#pragma once

#include <cstdint>
#include <cstring>

#include "common/simd/lanes.h"

namespace strandcast::simd::raw {

inline constexpr uint32_t kLaneCount = kLanes;
using Lanes = FloatBits;
using IntLanes = IntBits;
using UintLanes = UintBits;

/// A three-component vector in each lane.
struct LaneVectors {
  Lanes axis[3];
};
struct IntLaneVectors {
  IntLanes axis[3];
};

STRANDCAST_LANES Lanes load_lanes(const float* from) {
  Lanes lanes;
  std::memcpy(&lanes, from, sizeof lanes);
  return lanes;
}
STRANDCAST_LANES IntLanes load_lanes(const int32_t* from) {
  IntLanes lanes;
  std::memcpy(&lanes, from, sizeof lanes);
  return lanes;
}
STRANDCAST_LANES UintLanes load_lanes(const uint32_t* from) {
  UintLanes lanes;
  std::memcpy(&lanes, from, sizeof lanes);
  return lanes;
}
STRANDCAST_LANES void store_lanes(const UintLanes& lanes, uint32_t* to) {
  std::memcpy(to, &lanes, sizeof lanes);
}
STRANDCAST_LANES void store_lanes(const Lanes& lanes, float* to) {
  std::memcpy(to, &lanes, sizeof lanes);
}
STRANDCAST_LANES void store_lanes(const IntLanes& lanes, int32_t* to) {
  std::memcpy(to, &lanes, sizeof lanes);
}

/// Loads from[index[lane]] into each lane.
STRANDCAST_LANES Lanes gather_lanes(const float* from, const uint32_t* index) {
  return Lanes{from[index[0]], from[index[1]], from[index[2]], from[index[3]],
               from[index[4]], from[index[5]], from[index[6]], from[index[7]]};
}
STRANDCAST_LANES IntLanes gather_lanes(const int32_t* from, const uint32_t* index) {
  return IntLanes{from[index[0]], from[index[1]], from[index[2]], from[index[3]],
                  from[index[4]], from[index[5]], from[index[6]], from[index[7]]};
}

STRANDCAST_LANES Lanes square_roots(const Lanes& value) {
  return sqrt(Float(value)).v;
}
STRANDCAST_LANES Lanes sizes_of(const Lanes& value) {
  return abs(Float(value)).v;
}
STRANDCAST_LANES Lanes to_floats(const IntLanes& value) {
  return __builtin_convertvector(value, Lanes);
}
/// Truncates to integers; NaN and values out of range give the least integer.
STRANDCAST_LANES IntLanes to_integers(const Lanes& value) {
  return to_int_bits(value);
}

/// Sums and differences of integers that wrap around on overflow.
STRANDCAST_LANES IntLanes wrapping_sums(const IntLanes& a, const IntLanes& b) {
  return (IntLanes)((UintLanes)a + (UintLanes)b);
}
STRANDCAST_LANES IntLanes wrapping_differences(const IntLanes& a, const IntLanes& b) {
  return (IntLanes)((UintLanes)a - (UintLanes)b);
}

STRANDCAST_LANES Lanes dots(const LaneVectors& a, const LaneVectors& b) {
  return (a.axis[0] * b.axis[0] + a.axis[1] * b.axis[1]) + a.axis[2] * b.axis[2];
}

/// Returns true if a comparison holds in any lane.
STRANDCAST_LANES bool is_any(const IntLanes& comparison) {
  return is_any(Bool{comparison});
}

}  // namespace strandcast::simd::raw

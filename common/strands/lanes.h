// Lanes: four floats or integers side by side in a vector register (vector extensions of GCC and Clang; every
// processor that we build for has registers of this width, and twice as wide ones measured no faster). The
// same operations in the same order for every lane as scalars would have, so the same bits everywhere.
// Private to common/strands.
#pragma once

#include <cstdint>
#include <cstring>

#define STRANDCAST_INLINE __attribute__((always_inline)) inline

namespace strandcast {

inline constexpr uint32_t kLaneCount = 4;
using Lanes = float __attribute__((vector_size(4 * kLaneCount)));
using IntLanes = int32_t __attribute__((vector_size(4 * kLaneCount)));
using UintLanes = uint32_t __attribute__((vector_size(4 * kLaneCount)));

/// One vector in each lane.
struct LaneVectors {
  Lanes axis[3];
};
struct IntLaneVectors {
  IntLanes axis[3];
};

STRANDCAST_INLINE Lanes load_lanes(const float* from) {
  Lanes lanes;
  std::memcpy(&lanes, from, sizeof lanes);
  return lanes;
}
STRANDCAST_INLINE IntLanes load_lanes(const int32_t* from) {
  IntLanes lanes;
  std::memcpy(&lanes, from, sizeof lanes);
  return lanes;
}
STRANDCAST_INLINE void store_lanes(const Lanes& lanes, float* to) {
  std::memcpy(to, &lanes, sizeof lanes);
}
STRANDCAST_INLINE void store_lanes(const IntLanes& lanes, int32_t* to) {
  std::memcpy(to, &lanes, sizeof lanes);
}

/// from[index[lane]] for each lane.
STRANDCAST_INLINE Lanes gather_lanes(const float* from, const uint32_t* index) {
  return Lanes{from[index[0]], from[index[1]], from[index[2]], from[index[3]]};
}
STRANDCAST_INLINE IntLanes gather_lanes(const int32_t* from, const uint32_t* index) {
  return IntLanes{from[index[0]], from[index[1]], from[index[2]], from[index[3]]};
}

STRANDCAST_INLINE Lanes square_roots(const Lanes& value) {
  Lanes root;
  for (uint32_t lane = 0; lane < kLaneCount; ++lane) root[lane] = __builtin_sqrtf(value[lane]);
  return root;
}
STRANDCAST_INLINE Lanes sizes_of(const Lanes& value) {
  return value < 0.0f ? -value : value;
}
STRANDCAST_INLINE Lanes to_floats(const IntLanes& value) {
  return __builtin_convertvector(value, Lanes);
}
/// Towards zero; any number where the value is not one that fits.
STRANDCAST_INLINE IntLanes to_integers(const Lanes& value) {
  return __builtin_convertvector(value, IntLanes);
}

/// Sums and differences that wrap around.
STRANDCAST_INLINE IntLanes wrapping_sums(const IntLanes& a, const IntLanes& b) {
  return (IntLanes)((UintLanes)a + (UintLanes)b);
}
STRANDCAST_INLINE IntLanes wrapping_differences(const IntLanes& a, const IntLanes& b) {
  return (IntLanes)((UintLanes)a - (UintLanes)b);
}

STRANDCAST_INLINE Lanes dots(const LaneVectors& a, const LaneVectors& b) {
  return (a.axis[0] * b.axis[0] + a.axis[1] * b.axis[1]) + a.axis[2] * b.axis[2];
}

/// True when a comparison holds in some lane.
STRANDCAST_INLINE bool is_any(const IntLanes& comparison) {
  uint64_t parts[sizeof(IntLanes) / sizeof(uint64_t)];
  std::memcpy(parts, &comparison, sizeof parts);
  return (parts[0] | parts[1]) != 0;
}

}  // namespace strandcast

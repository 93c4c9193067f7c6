// Pairs of lanes: the types of common/simd/lanes.h and lane_matrices.h over two registers at a time. Two
// independent chains of operations hide the latency of roots and quotients. For kernels that walk along
// strands and wait for results more than they compute. Results are the same bits as with single registers.
#pragma once

#include "common/simd/lanes.h"

namespace strandcast::simd {
inline namespace STRANDCAST_LANE_NAMESPACE {
namespace pairs {

using One = STRANDCAST_LANE_NAMESPACE::Float;
using OneUint = STRANDCAST_LANE_NAMESPACE::Uint;
using OneBool = STRANDCAST_LANE_NAMESPACE::Bool;

struct Bool {
  OneBool a, b;
  template <class Other>
  operator Other() const {
    static_assert(sizeof(Other) == 0,
                  "what differs between strands cannot steer if, ?:, a loop or a bool: use is_any(), "
                  "select() or lane_bool");
  }
};
struct Float;
struct Uint {
  OneUint a, b;
  Uint() = default;
  STRANDCAST_LANES explicit Uint(Float value);
  STRANDCAST_LANES constexpr Uint(OneUint a_, OneUint b_) : a(a_), b(b_) {}
  template <std::same_as<uint32_t> Number>
  STRANDCAST_LANES constexpr Uint(Number value) : a(value), b(value) {}
};
struct Float {
  One a, b;
  Float() = default;
  STRANDCAST_LANES constexpr Float(One a_, One b_) : a(a_), b(b_) {}
  template <class Number>
  requires(std::same_as<Number, float> || std::same_as<Number, int> || std::same_as<Number, uint32_t> ||
           std::same_as<Number, bool> || std::same_as<Number, double>) STRANDCAST_LANES
      constexpr Float(Number value)
      : a(value), b(value) {}
  STRANDCAST_LANES explicit Float(Uint value) : a(value.a), b(value.b) {}
};
STRANDCAST_LANES Uint::Uint(Float value) : a(value.a), b(value.b) {}

#define STRANDCAST_OF_TWO(Result, op, Type)                    \
  STRANDCAST_LANES Result operator op(Type left, Type right) { \
    return {left.a op right.a, left.b op right.b};             \
  }
STRANDCAST_OF_TWO(Float, +, Float)
STRANDCAST_OF_TWO(Float, -, Float)
STRANDCAST_OF_TWO(Float, *, Float)
STRANDCAST_OF_TWO(Float, /, Float)
STRANDCAST_OF_TWO(Bool, <, Float)
STRANDCAST_OF_TWO(Bool, >, Float)
STRANDCAST_OF_TWO(Bool, <=, Float)
STRANDCAST_OF_TWO(Bool, >=, Float)
STRANDCAST_OF_TWO(Bool, ==, Float)
STRANDCAST_OF_TWO(Bool, !=, Float)
STRANDCAST_OF_TWO(Bool, >=, Uint)
STRANDCAST_OF_TWO(Bool, &&, Bool)
STRANDCAST_OF_TWO(Bool, ||, Bool)
STRANDCAST_OF_TWO(Uint, +, Uint)
STRANDCAST_OF_TWO(Uint, *, Uint)
STRANDCAST_OF_TWO(Uint, ^, Uint)
STRANDCAST_OF_TWO(Uint, &, Uint)
STRANDCAST_OF_TWO(Uint, |, Uint)
#undef STRANDCAST_OF_TWO
#define STRANDCAST_ASSIGNED(op, Type)                             \
  STRANDCAST_LANES Type& operator op##=(Type& left, Type right) { \
    return left = left op right;                                  \
  }
STRANDCAST_ASSIGNED(+, Float)
STRANDCAST_ASSIGNED(-, Float)
STRANDCAST_ASSIGNED(*, Float)
STRANDCAST_ASSIGNED(/, Float)
STRANDCAST_ASSIGNED(^, Uint)
STRANDCAST_ASSIGNED(*, Uint)
#undef STRANDCAST_ASSIGNED
STRANDCAST_LANES Float operator-(Float x) {
  return {-x.a, -x.b};
}
STRANDCAST_LANES Bool operator!(Bool x) {
  return {!x.a, !x.b};
}
STRANDCAST_LANES Uint operator>>(Uint x, int bits) {
  return {x.a >> bits, x.b >> bits};
}
STRANDCAST_LANES Uint operator<<(Uint x, int bits) {
  return {x.a << bits, x.b << bits};
}

#define STRANDCAST_OF_ONE(name)                                                          \
  STRANDCAST_LANES Float name(Float x) {                                                 \
    return {STRANDCAST_LANE_NAMESPACE::name(x.a), STRANDCAST_LANE_NAMESPACE::name(x.b)}; \
  }
STRANDCAST_OF_ONE(abs)
STRANDCAST_OF_ONE(sqrt)
STRANDCAST_OF_ONE(inversesqrt)
STRANDCAST_OF_ONE(floor)
STRANDCAST_OF_ONE(exp)
STRANDCAST_OF_ONE(sin)
STRANDCAST_OF_ONE(cos)
#undef STRANDCAST_OF_ONE
#define STRANDCAST_OF_BOTH(name, Type)                                                             \
  STRANDCAST_LANES Type name(Type x, Type y) {                                                     \
    return {STRANDCAST_LANE_NAMESPACE::name(x.a, y.a), STRANDCAST_LANE_NAMESPACE::name(x.b, y.b)}; \
  }
STRANDCAST_OF_BOTH(min, Float)
STRANDCAST_OF_BOTH(max, Float)
STRANDCAST_OF_BOTH(min, Uint)
STRANDCAST_OF_BOTH(max, Uint)
STRANDCAST_OF_BOTH(pow, Float)
STRANDCAST_OF_BOTH(atan, Float)
#undef STRANDCAST_OF_BOTH
STRANDCAST_LANES Float select(Bool which, Float yes, Float no) {
  return {STRANDCAST_LANE_NAMESPACE::select(which.a, yes.a, no.a),
          STRANDCAST_LANE_NAMESPACE::select(which.b, yes.b, no.b)};
}
STRANDCAST_LANES Float clamp(Float x, Float low, Float high) {
  return min(max(x, low), high);
}
STRANDCAST_LANES Float mix(Float a, Float b, Float share) {
  return a + share * (b - a);
}
STRANDCAST_LANES Uint floatBitsToUint(Float x) {
  return {STRANDCAST_LANE_NAMESPACE::floatBitsToUint(x.a), STRANDCAST_LANE_NAMESPACE::floatBitsToUint(x.b)};
}
STRANDCAST_LANES bool is_any(Bool which) {
  return STRANDCAST_LANE_NAMESPACE::is_any(which.a || which.b);
}
STRANDCAST_LANES Bool lanes_that(bool value) {
  return {STRANDCAST_LANE_NAMESPACE::lanes_that(value), STRANDCAST_LANE_NAMESPACE::lanes_that(value)};
}

#include "common/simd/lane_vectors_private.h"
// clang-format keeps this one behind the other
#include "common/simd/lane_matrices_private.h"
}  // namespace pairs
}  // namespace STRANDCAST_LANE_NAMESPACE
}  // namespace strandcast::simd

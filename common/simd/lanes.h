// Lanes: GLSL's types and functions over invocations side by side in vector registers. Code in shaders/
// thereby runs on the CPU too (common/render/laws.h, common/kernels/lane_kernel_private.h). Every lane
// computes what a scalar would, without contraction, so all instruction sets and lane counts give the same
// bits. Choices use select(), never branches. Everything is inline. Instruction sets are chosen by
// common/simd/variants.h. STRANDCAST_LANE_COUNT, set when a file is compiled, is 8 by default and may be 4 or
// 16.
#pragma once

#include <concepts>
#include <cstdint>
#include <cstring>

#ifndef STRANDCAST_LANE_COUNT
#define STRANDCAST_LANE_COUNT 8
#endif
// Where the compiler may use what only the wider sets have, which generic vectors do not find.
#if defined(__AVX512F__) && STRANDCAST_LANE_COUNT == 16
#include <immintrin.h>
#define STRANDCAST_HAS_MASKS 1
#else
#define STRANDCAST_HAS_MASKS 0
#if defined(__AVX2__) && STRANDCAST_LANE_COUNT == 8
#include <immintrin.h>
#endif
#endif
#if defined(__wasm_simd128__)
#include <wasm_simd128.h>
#endif
// Kernels count numbers too small for full precision (below 2^-126) as 0. Where the processor has no mode for
// that (WebAssembly), they define this as 1, and lanes do it wherever such a number could come to matter:
// what is loaded, stored, compared, divided or divided by, and what a root is taken of. Sums and products
// leave it: to do it there as well takes five to seven times as long, and beside a number that is not as
// small itself (above 2^-102) what is left vanishes in rounding.
#ifndef STRANDCAST_LANES_FLUSH
#define STRANDCAST_LANES_FLUSH 0
#endif

#if STRANDCAST_LANES_FLUSH
#define STRANDCAST_LANE_NAMESPACE flushed_lanes4
#if STRANDCAST_LANE_COUNT != 4
#error "only four lanes flush by themselves"
#endif
#elif STRANDCAST_LANE_COUNT == 16
#define STRANDCAST_LANE_NAMESPACE lanes16
#elif STRANDCAST_LANE_COUNT == 8
#define STRANDCAST_LANE_NAMESPACE lanes8
#elif STRANDCAST_LANE_COUNT == 4
#define STRANDCAST_LANE_NAMESPACE lanes4
#else
#error "there are 4, 8 or 16 lanes"
#endif

namespace strandcast::simd {
/// Namespace whose name contains the lane count, since types differ with it.
inline namespace STRANDCAST_LANE_NAMESPACE {

inline constexpr uint32_t kLanes = STRANDCAST_LANE_COUNT;
inline constexpr float kLeastFloat = 1.17549435e-38f;  // of full precision, 2^-126

#define STRANDCAST_LANES inline __attribute__((always_inline))
#define STRANDCAST_LANES_LAMBDA __attribute__((always_inline))  // behind a lambda's parameters

using FloatBits = float __attribute__((vector_size(4 * kLanes)));
using IntBits = int32_t __attribute__((vector_size(4 * kLanes)));
using UintBits = uint32_t __attribute__((vector_size(4 * kLanes)));

/// A boolean in each lane. It cannot steer a branch, because lanes may differ.
struct Bool {
#if STRANDCAST_HAS_MASKS
  __mmask16 v;
#else
  IntBits v;  // all bits of a lane, or none
#endif
  template <class Other>
  operator Other() const {
    static_assert(sizeof(Other) == 0,
                  "what differs between strands cannot steer if, ?:, a loop or a bool: use is_any(), "
                  "select() or lane_bool");
  }
};

/// Truncates to integers. NaN and values out of range give the least integer, as on x86.
STRANDCAST_LANES IntBits to_int_bits(FloatBits x) {
  IntBits whole = __builtin_convertvector(x, IntBits);
#if !defined(__x86_64__)  // others give the nearest that fits, and 0 for NaN
  const IntBits fits = x < 2147483648.0f;
  const UintBits least = UintBits{} + 0x80000000u;
  whole = (whole & fits) | ((IntBits)least & ~fits);
#endif
  return whole;
}

/// Replaces subnormal numbers with zero of the same sign, where the processor's lanes do so.
STRANDCAST_LANES FloatBits flushed(FloatBits x) {
#if STRANDCAST_LANES_FLUSH
  const v128_t bits = (v128_t)x;
  const v128_t is_tiny = wasm_f32x4_lt(wasm_f32x4_abs(bits), wasm_f32x4_splat(kLeastFloat));
  return (FloatBits)wasm_v128_andnot(bits, wasm_u32x4_shr(is_tiny, 1));
#else
  return x;
#endif
}

struct Float;

struct Uint {
  UintBits v;
  Uint() = default;
  STRANDCAST_LANES constexpr Uint(UintBits bits) : v(bits) {}
  template <std::same_as<uint32_t> Number>
  STRANDCAST_LANES constexpr Uint(Number value) : v(UintBits{} + value) {}
  /// Truncates values in 0 .. 2^31.
  STRANDCAST_LANES explicit Uint(Float value);
};

struct Float {
  FloatBits v;
  Float() = default;
  STRANDCAST_LANES constexpr Float(FloatBits bits) : v(bits) {}
  STRANDCAST_LANES constexpr Float(float value) : v(FloatBits{} + value) {}
  STRANDCAST_LANES constexpr Float(double value) : v(FloatBits{} + static_cast<float>(value)) {}
  STRANDCAST_LANES constexpr Float(int value) : v(FloatBits{} + static_cast<float>(value)) {}
  STRANDCAST_LANES constexpr Float(uint32_t value) : v(FloatBits{} + static_cast<float>(value)) {}
  /// Converts values below 2^31.
  STRANDCAST_LANES explicit Float(Uint value) : v(__builtin_convertvector((IntBits)value.v, FloatBits)) {}
};

STRANDCAST_LANES Uint::Uint(Float value) : v((UintBits)to_int_bits(value.v)) {}

// ---- operators
STRANDCAST_LANES constexpr Float operator+(Float a, Float b) {
  return a.v + b.v;
}
STRANDCAST_LANES constexpr Float operator-(Float a, Float b) {
  return a.v - b.v;
}
STRANDCAST_LANES constexpr Float operator*(Float a, Float b) {
  return a.v * b.v;
}
STRANDCAST_LANES Float operator/(Float a, Float b) {
  return flushed(a.v) / flushed(b.v);
}
STRANDCAST_LANES constexpr Float operator-(Float a) {
  return -a.v;
}
STRANDCAST_LANES Float& operator+=(Float& a, Float b) {
  return a = a + b;
}
STRANDCAST_LANES Float& operator-=(Float& a, Float b) {
  return a = a - b;
}
STRANDCAST_LANES Float& operator*=(Float& a, Float b) {
  return a = a * b;
}
STRANDCAST_LANES Float& operator/=(Float& a, Float b) {
  return a = a / b;
}

#if STRANDCAST_HAS_MASKS
#define STRANDCAST_COMPARISON(op, number)                          \
  STRANDCAST_LANES Bool operator op(Float a, Float b) {            \
    return {_mm512_cmp_ps_mask((__m512)a.v, (__m512)b.v, number)}; \
  }
STRANDCAST_COMPARISON(<, _CMP_LT_OQ)
STRANDCAST_COMPARISON(>, _CMP_GT_OQ)
STRANDCAST_COMPARISON(<=, _CMP_LE_OQ)
STRANDCAST_COMPARISON(>=, _CMP_GE_OQ)
STRANDCAST_COMPARISON(==, _CMP_EQ_OQ)
STRANDCAST_COMPARISON(!=, _CMP_NEQ_UQ)
#undef STRANDCAST_COMPARISON
STRANDCAST_LANES Bool operator>=(Uint a, Uint b) {
  return {_mm512_cmp_epu32_mask((__m512i)a.v, (__m512i)b.v, _MM_CMPINT_NLT)};
}
STRANDCAST_LANES Bool operator&&(Bool a, Bool b) {
  return {static_cast<__mmask16>(a.v & b.v)};
}
STRANDCAST_LANES Bool operator||(Bool a, Bool b) {
  return {static_cast<__mmask16>(a.v | b.v)};
}
STRANDCAST_LANES Bool operator!(Bool a) {
  return {static_cast<__mmask16>(~a.v)};
}
STRANDCAST_LANES Bool lanes_that(bool value) {
  return {static_cast<__mmask16>(value ? 0xffff : 0)};
}
#else
STRANDCAST_LANES Bool operator<(Float a, Float b) {
  return {flushed(a.v) < flushed(b.v)};
}
STRANDCAST_LANES Bool operator>(Float a, Float b) {
  return {flushed(a.v) > flushed(b.v)};
}
STRANDCAST_LANES Bool operator<=(Float a, Float b) {
  return {flushed(a.v) <= flushed(b.v)};
}
STRANDCAST_LANES Bool operator>=(Float a, Float b) {
  return {flushed(a.v) >= flushed(b.v)};
}
STRANDCAST_LANES Bool operator==(Float a, Float b) {
  return {flushed(a.v) == flushed(b.v)};
}
STRANDCAST_LANES Bool operator!=(Float a, Float b) {
  return {flushed(a.v) != flushed(b.v)};
}
STRANDCAST_LANES Bool operator>=(Uint a, Uint b) {
  return {a.v >= b.v};
}
STRANDCAST_LANES Bool operator&&(Bool a, Bool b) {
  return {a.v & b.v};
}
STRANDCAST_LANES Bool operator||(Bool a, Bool b) {
  return {a.v | b.v};
}
STRANDCAST_LANES Bool operator!(Bool a) {
  return {~a.v};
}
STRANDCAST_LANES Bool lanes_that(bool value) {
  return {IntBits{} - (value ? 1 : 0)};
}
#endif

STRANDCAST_LANES Uint operator+(Uint a, Uint b) {
  return a.v + b.v;
}
STRANDCAST_LANES Uint operator*(Uint a, Uint b) {
  return a.v * b.v;
}
STRANDCAST_LANES Uint operator^(Uint a, Uint b) {
  return a.v ^ b.v;
}
STRANDCAST_LANES Uint operator&(Uint a, Uint b) {
  return a.v & b.v;
}
STRANDCAST_LANES Uint operator|(Uint a, Uint b) {
  return a.v | b.v;
}
STRANDCAST_LANES Uint operator>>(Uint a, int bits) {
  return a.v >> bits;
}
STRANDCAST_LANES Uint operator<<(Uint a, int bits) {
  return a.v << bits;
}
STRANDCAST_LANES Uint& operator^=(Uint& a, Uint b) {
  return a = a ^ b;
}
STRANDCAST_LANES Uint& operator*=(Uint& a, Uint b) {
  return a = a * b;
}

// ---- functions of GLSL on one number
#if STRANDCAST_HAS_MASKS
STRANDCAST_LANES Float select(Bool which, Float yes, Float no) {
  return (FloatBits)_mm512_mask_blend_ps(which.v, (__m512)no.v, (__m512)yes.v);
}
STRANDCAST_LANES Uint select(Bool which, Uint yes, Uint no) {
  return (UintBits)_mm512_mask_blend_epi32(which.v, (__m512i)no.v, (__m512i)yes.v);
}
STRANDCAST_LANES Float min(Float a, Float b) {
  return (FloatBits)_mm512_min_ps((__m512)a.v, (__m512)b.v);
}  // b where one is no number
STRANDCAST_LANES Float max(Float a, Float b) {
  return (FloatBits)_mm512_max_ps((__m512)a.v, (__m512)b.v);
}
STRANDCAST_LANES Uint max(Uint a, Uint b) {
  return (UintBits)_mm512_max_epu32((__m512i)a.v, (__m512i)b.v);
}
STRANDCAST_LANES Uint min(Uint a, Uint b) {
  return (UintBits)_mm512_min_epu32((__m512i)a.v, (__m512i)b.v);
}
STRANDCAST_LANES Float sqrt(Float x) {
  return (FloatBits)_mm512_sqrt_ps((__m512)x.v);
}
#else
STRANDCAST_LANES Float select(Bool which, Float yes, Float no) {
  return which.v ? yes.v : no.v;
}
STRANDCAST_LANES Uint select(Bool which, Uint yes, Uint no) {
  return which.v ? yes.v : no.v;
}
// One instruction each, which compilers do not make of a comparison and a choice: b where one is no number,
// and where both are zero.
STRANDCAST_LANES Float min(Float a, Float b) {
#if defined(__AVX2__) && STRANDCAST_LANE_COUNT == 8
  return (FloatBits)_mm256_min_ps((__m256)a.v, (__m256)b.v);
#elif defined(__SSE4_1__) && STRANDCAST_LANE_COUNT == 4
  return (FloatBits)_mm_min_ps((__m128)a.v, (__m128)b.v);
#else
  return a.v < b.v ? a.v : b.v;
#endif
}
STRANDCAST_LANES Float max(Float a, Float b) {
#if defined(__AVX2__) && STRANDCAST_LANE_COUNT == 8
  return (FloatBits)_mm256_max_ps((__m256)a.v, (__m256)b.v);
#elif defined(__SSE4_1__) && STRANDCAST_LANE_COUNT == 4
  return (FloatBits)_mm_max_ps((__m128)a.v, (__m128)b.v);
#else
  return a.v > b.v ? a.v : b.v;
#endif
}
STRANDCAST_LANES Uint max(Uint a, Uint b) {
  return a.v > b.v ? a.v : b.v;
}
STRANDCAST_LANES Uint min(Uint a, Uint b) {
  return a.v < b.v ? a.v : b.v;
}
STRANDCAST_LANES Float sqrt(Float x) {
#if defined(__AVX2__) && STRANDCAST_LANE_COUNT == 8
  return (FloatBits)_mm256_sqrt_ps((__m256)x.v);
#elif defined(__wasm_simd128__)
  v128_t parts[sizeof(FloatBits) / sizeof(v128_t)];
  const FloatBits of = flushed(x.v);
  std::memcpy(parts, &of, sizeof parts);
  for (v128_t& part : parts) part = wasm_f32x4_sqrt(part);
  FloatBits root;
  std::memcpy(&root, parts, sizeof root);
  return root;
#else
  FloatBits root;
  for (uint32_t lane = 0; lane < kLanes; ++lane) root[lane] = __builtin_sqrtf(x.v[lane]);
  return root;
#endif
}
#endif
STRANDCAST_LANES Float clamp(Float x, Float low, Float high) {
  return min(max(x, low), high);
}
STRANDCAST_LANES Float mix(Float a, Float b, Float share) {
  return a + share * (b - a);
}
STRANDCAST_LANES Float abs(Float x) {
  return (FloatBits)((UintBits)x.v & 0x7fffffffu);
}
STRANDCAST_LANES Float inversesqrt(Float x) {
  return 1.0f / sqrt(x);
}
/// Rounds down values within +-2^31.
STRANDCAST_LANES Float floor(Float x) {
  const FloatBits cut = __builtin_convertvector(to_int_bits(x.v), FloatBits);
  return cut > x.v ? cut - 1.0f : cut;
}
STRANDCAST_LANES Float fract(Float x) {
  return x - floor(x);
}
STRANDCAST_LANES Float smoothstep(Float low, Float high, Float x) {
  const Float t = clamp((x - low) / (high - low), 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}
/// e^x with a relative error below 3e-7; 0 for x < -87, and x above 88 counts as 88.
STRANDCAST_LANES Float exp(Float x) {
  // 2^n 2^f with |f| <= 1/2; the polynomial is the Taylor series of 2^f to the sixth power.
  const Float y = clamp(x, -87.0f, 88.0f) * 1.44269504f;
  const Float n = floor(y + 0.5f);
  const Float f = (y - n) * 0.693147181f;
  const Float p =
      1.0f + f * (1.0f + f * (0.5f + f * (1.66666667e-1f +
                                          f * (4.16666667e-2f + f * (8.33333333e-3f + f * 1.38888889e-3f)))));
  const IntBits power = (to_int_bits(n.v) + 127) << 23;
  return p * Float((FloatBits)power);
}
/// Base-2 logarithm of positive numbers, with an absolute error below 1e-6.
STRANDCAST_LANES Float log2(Float x) {
  const IntBits bits = (IntBits)x.v;
  IntBits exponent = (bits >> 23) - 127;
  FloatBits m = (FloatBits)((bits & 0x7fffff) | 0x3f800000);
  const IntBits is_big = m > 1.41421356f;
  m = is_big ? m * 0.5f : m;
  exponent -= is_big;  // a true lane is -1
  // log2(m) = 2 / ln 2 * artanh(s), s = (m - 1) / (m + 1), |s| < 0.1716
  const Float s = Float(m - 1.0f) / Float(m + 1.0f);
  const Float s2 = s * s;
  const Float series =
      s * (2.88539008f + s2 * (0.961796694f + s2 * (0.577078016f + s2 * (0.412198583f + s2 * 0.320598898f))));
  return Float(__builtin_convertvector(exponent, FloatBits)) + series;
}
STRANDCAST_LANES Float pow(Float x, Float power) {
  return exp(0.693147181f * (power * log2(x)));
}

/// Sine of x shifted by quarter turns (shift 1 gives the cosine); error below 1e-6 for |x| < 1e4.
STRANDCAST_LANES Float sine_of_quarters(Float x, int shift) {
  // Minimax polynomials of the Cephes library's sinf and cosf on [-pi/4, pi/4].
  const Float quarters = floor(x * 0.636619772f + 0.5f);
  const Float r = ((x - quarters * 1.5703125f) - quarters * 4.83751297e-4f) - quarters * 7.54978995e-8f;
  const Float z = r * r;
  const Float s = r + r * z * (-1.66666546e-1f + z * (8.33216087e-3f - z * 1.95152959e-4f));
  const Float c = 1.0f - 0.5f * z + z * z * (4.16666457e-2f + z * (-1.38873163e-3f + z * 2.44331571e-5f));
  const IntBits n = to_int_bits(quarters.v) + shift;
  const FloatBits value = (n & 1) != 0 ? c.v : s.v;
  return (FloatBits)((IntBits)value ^ ((n & 2) << 30));
}
STRANDCAST_LANES Float sin(Float x) {
  return sine_of_quarters(x, 0);
}
STRANDCAST_LANES Float cos(Float x) {
  return sine_of_quarters(x, 1);
}
/// Angle of (x, y) in radians, within +-pi; error below 4e-7. Returns 0 for (0, 0).
STRANDCAST_LANES Float atan(Float y, Float x) {
  // The Cephes library's atanf on [0, tan(pi / 8)], of the smaller over the larger side.
  const Float tall = abs(y);
  const Float wide = abs(x);
  const Float larger = max(max(tall, wide), 1e-37f);
  const Float ratio = min(tall, wide) / larger;
  const Bool is_steep = ratio > 0.414213562f;
  const Float t = select(is_steep, (ratio - 1.0f) / (ratio + 1.0f), ratio);
  const Float z = t * t;
  const Float series = t + t * z *
                               (-3.33329491539e-1f +
                                z * (1.99777106478e-1f + z * (-1.38776856032e-1f + z * 8.05374449538e-2f)));
  Float angle = select(is_steep, 0.785398163f + series, series);
  angle = select(tall > wide, 1.57079633f - angle, angle);
  angle = select(x < 0.0f, 3.14159265f - angle, angle);
  return (FloatBits)((UintBits)angle.v | ((UintBits)y.v & 0x80000000u));
}

STRANDCAST_LANES Uint floatBitsToUint(Float x) {
  return (UintBits)x.v;
}

// ---- beyond GLSL
STRANDCAST_LANES bool is_any(Bool which) {
#if STRANDCAST_HAS_MASKS
  return which.v != 0;
#elif defined(__AVX2__) && STRANDCAST_LANE_COUNT == 8
  return _mm256_movemask_ps((__m256)which.v) != 0;
#elif defined(__wasm_simd128__)
  v128_t parts[sizeof(IntBits) / sizeof(v128_t)];
  std::memcpy(parts, &which.v, sizeof parts);
  v128_t all = parts[0];
  for (size_t i = 1; i < sizeof parts / sizeof(v128_t); ++i) all = wasm_v128_or(all, parts[i]);
  return wasm_v128_any_true(all);
#else
  uint64_t parts[sizeof(IntBits) / sizeof(uint64_t)];
  std::memcpy(parts, &which.v, sizeof parts);
  uint64_t all = 0;
  for (const uint64_t part : parts) all |= part;
  return all != 0;
#endif
}
STRANDCAST_LANES Float load_lanes(const float* from) {
  FloatBits v;
  std::memcpy(&v, from, sizeof v);
  return flushed(v);
}
STRANDCAST_LANES void store_lanes(Float x, float* to) {
  const FloatBits v = flushed(x.v);
  std::memcpy(to, &v, sizeof v);
}
#if STRANDCAST_LANE_COUNT == 8
/// Returns the index of each lane: 0, 1, 2, ...
STRANDCAST_LANES Float lane_numbers() {
  return FloatBits{0, 1, 2, 3, 4, 5, 6, 7};
}
#endif
/// Truncates values within +-2^31 to integers.
STRANDCAST_LANES IntBits to_integers(Float x) {
  return to_int_bits(x.v);
}

#include "common/simd/lane_vectors_private.h"

}  // namespace STRANDCAST_LANE_NAMESPACE
}  // namespace strandcast::simd

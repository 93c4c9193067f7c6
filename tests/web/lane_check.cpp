#include "tests/web/lane_check.h"

#define STRANDCAST_LANE_COUNT 4
#if defined(__SSE2__)
#include <immintrin.h>
#elif !defined(__aarch64__)
#define STRANDCAST_LANES_FLUSH 1
#endif
#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <vector>

#include "common/base/hash.h"
#include "common/simd/lanes.h"

namespace strandcast {
namespace {

using namespace simd;

/// Around every edge, of both signs.
std::vector<float> numbers() {
  using Limits = std::numeric_limits<float>;
  std::vector<float> list = {0.0f, Limits::infinity(), Limits::quiet_NaN()};
  for (const float edge : {Limits::denorm_min(), Limits::min(), Limits::max(), 1.0f, 0.5f, 2147483648.0f,
                           1e-20f, 1e-19f, 1.5e-30f, 3e38f, 7.1e-39f, 1e-45f, 0.75f, 1.5707964f, 88.0f})
    for (const float near : {std::nextafter(edge, 0.0f), edge, std::nextafter(edge, Limits::infinity())})
      list.push_back(near);
  for (size_t i = list.size(); i-- > 0;) list.push_back(-list[i]);
  while (list.size() % kLanes != 0) list.push_back(1.0f);
  return list;
}

/// As the next operation sees it; all NaN are one.
void add(Float result, uint64_t& hash) {
  static volatile float one = 1.0f;
  float kept[kLanes];
  store_lanes(result * one, kept);
  for (const float value : kept) {
    uint32_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    hash = hash_word((bits & 0x7fffffffu) > 0x7f800000u ? 0x7fc00000u : bits, hash);
  }
}
void add(Bool result, uint64_t& hash) {
  add(select(result, Float(1.0f), Float(0.0f)), hash);
}

template <class Function>
std::string line(const char* name, Function function) {
  const std::vector<float> list = numbers();
  uint64_t hash = 0;
  for (const float second : list) {
    const std::vector<float> all(kLanes, second);
    for (size_t i = 0; i < list.size(); i += kLanes)
      add(function(load_lanes(&list[i]), load_lanes(all.data())), hash);
  }
  return fmt::format("{} {:016x}\n", name, hash);
}

/// The one difference: of products that are rounded to the least number x86 makes some 0, as it asks what
/// they would be rounded to if exponents had no end. Those are left out.
Float product(Float a, Float b) {
  const Float result = a * b;
  return select(abs(result) <= 1.17549435e-38f, Float(0.0f), result);
}

std::string all_lines() {
  std::string lines;
  const auto add_line = [&](const char* name, auto function) { lines += line(name, function); };
  add_line("load", [](Float x, Float) { return x; });
  add_line("+", [](Float x, Float y) { return x + y; });
  add_line("-", [](Float x, Float y) { return x - y; });
  add_line("*", [](Float x, Float y) { return product(x, y); });
  add_line("/", [](Float x, Float y) { return x / y; });
  add_line("1 / root of product", [](Float x, Float y) { return inversesqrt(product(x, y)); });
  add_line("quotient of products", [](Float x, Float y) { return product(x, x) / product(y, y); });
  add_line("<", [](Float x, Float y) { return x < y; });
  add_line(">", [](Float x, Float y) { return x > y; });
  add_line("<=", [](Float x, Float y) { return x <= y; });
  add_line(">=", [](Float x, Float y) { return x >= y; });
  add_line("==", [](Float x, Float y) { return x == y; });
  add_line("!=", [](Float x, Float y) { return x != y; });
  add_line("products >", [](Float x, Float y) { return product(x, x) > product(y, y); });
  add_line("min", [](Float x, Float y) { return min(x, y); });
  add_line("max", [](Float x, Float y) { return max(x, y); });
  add_line("clamp", [](Float x, Float y) { return clamp(x, -1.0f, y); });
  add_line("sqrt", [](Float x, Float) { return sqrt(x); });
  add_line("inversesqrt", [](Float x, Float) { return inversesqrt(x); });
  add_line("abs", [](Float x, Float) { return abs(x); });
  add_line("negative", [](Float x, Float) { return -x; });
  add_line("floor", [](Float x, Float) { return floor(x); });
  add_line("integers",
           [](Float x, Float) { return Float(__builtin_convertvector(to_integers(x), FloatBits)); });
  add_line("exp", [](Float x, Float) { return exp(x); });
  add_line("sin", [](Float x, Float) { return sin(x); });
  add_line("cos", [](Float x, Float) { return cos(x); });
  add_line("atan", [](Float x, Float y) { return atan(x, y); });
  add_line("pow", [](Float x, Float y) { return pow(product(x, y), y); });
  return lines;
}

}  // namespace

std::string lane_results() {
#if defined(__SSE2__)
  const unsigned before = _mm_getcsr();
  _mm_setcsr(before | 0x8040);  // as kernels do
#endif
  const std::string lines = all_lines();
#if defined(__SSE2__)
  _mm_setcsr(before);
#endif
  return lines;
}

}  // namespace strandcast

// Functions of lanes against the standard library in double, and the same bits from every instruction set.
#include "common/simd/lanes.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstring>
#include <glm/glm.hpp>
#include <vector>

#include "common/base/hash.h"
#include "common/render/laws.h"
#include "common/simd/lane_matrices.h"
#include "common/simd/variants.h"

namespace strandcast::lanes_test {
namespace {

using simd::InstructionSet;
using simd::kLanes;

enum Function { kExp, kLog2, kSin, kCos, kSqrt, kFloor, kPow, kMin, kFunctions };

struct FunctionArguments {
  const float* x;
  float* y;  // kFunctions rows
  size_t count;
};

STRANDCAST_LANES void run_functions_lanes(const FunctionArguments& a) {
  using namespace simd;
  for (size_t i = 0; i < a.count; i += kLanes) {
    const Float x = load_lanes(a.x + i);
    const Float size = max(abs(x), 1e-6f);
    const auto put = [&](Function f, Float y) __attribute__((always_inline)) {
      store_lanes(y, a.y + f * a.count + i);
    };
    put(kExp, exp(x));
    put(kLog2, log2(size));
    put(kSin, sin(x));
    put(kCos, cos(x));
    put(kSqrt, sqrt(size));
    put(kFloor, floor(x));
    put(kPow, pow(size, 1.7f));
    put(kMin, min(x, 2.0f));
  }
}
STRANDCAST_KERNEL(run_functions, FunctionArguments);

std::vector<float> sample_numbers() {
  std::vector<float> x;
  for (int i = 0; i < 4096; ++i) x.push_back(-40.0f + 80.0f * static_cast<float>(i) / 4095.0f);
  return x;
}

TEST(Lanes, FunctionsAreAsExactAsTold) {
  const std::vector<float> x = sample_numbers();
  std::vector<float> y(kFunctions * x.size());
  run_functions(InstructionSet::Plain, {x.data(), y.data(), x.size()});
  for (size_t i = 0; i < x.size(); ++i) {
    const auto of = [&](Function f) { return double{y[f * x.size() + i]}; };
    const double v = x[i];
    const double size = std::max(std::abs(v), 1e-6);
    // The argument itself is known to 2^-24 of it, which e^x multiplies by x.
    ASSERT_NEAR(of(kExp) / std::exp(v), 1.0, 5e-6) << v;
    ASSERT_NEAR(of(kLog2), std::log2(size), 2e-6) << v;
    ASSERT_NEAR(of(kSin), std::sin(v), 2e-6) << v;
    ASSERT_NEAR(of(kCos), std::cos(v), 2e-6) << v;
    ASSERT_EQ(of(kSqrt), std::sqrt(static_cast<float>(size))) << v;
    ASSERT_EQ(of(kFloor), std::floor(v)) << v;
    ASSERT_NEAR(of(kPow) / std::pow(size, 1.7), 1.0, 2e-5) << v;
    ASSERT_EQ(of(kMin), std::min(v, 2.0));
  }
}

TEST(Lanes, EveryInstructionSetGivesTheSameBits) {
  const std::vector<float> x = sample_numbers();
  std::vector<float> plain(kFunctions * x.size());
  run_functions(InstructionSet::Plain, {x.data(), plain.data(), x.size()});
  for (const InstructionSet set : simd::instruction_sets()) {
    std::vector<float> y(plain.size());
    run_functions(set, {x.data(), y.data(), x.size()});
    EXPECT_EQ(std::memcmp(y.data(), plain.data(), y.size() * sizeof(float)), 0) << to_string(set);
  }
}

TEST(Lanes, AnglesOfAllDirections) {
  using namespace simd;
  constexpr int kSteps = 8 * 1000;  // with all axes and diagonals
  for (int i = 0; i < kSteps; i += static_cast<int>(kLanes)) {
    Float x, y;
    for (uint32_t lane = 0; lane < kLanes; ++lane) {
      const double angle = 6.283185307179586 * (i + static_cast<int>(lane)) / kSteps;
      const double size = std::exp(0.01 * (i % 1000) - 5.0);
      x.v[lane] = static_cast<float>(size * std::cos(angle));
      y.v[lane] = static_cast<float>(size * std::sin(angle));
    }
    const Float found = atan(y, x);
    for (uint32_t lane = 0; lane < kLanes; ++lane)
      ASSERT_NEAR(found.v[lane], std::atan2(double{y.v[lane]}, double{x.v[lane]}), 4e-7) << x.v[lane];
  }
  EXPECT_EQ(atan(Float(0.0f), Float(0.0f)).v[0], 0.0f);
}

TEST(Lanes, MatricesAreByColumns) {
  const auto number = [](int i) { return unit_float(mix_u32(static_cast<uint32_t>(i))) - 0.5f; };
  const glm::vec3 a(number(0), number(1), number(2));
  const glm::vec3 b(number(3), number(4), number(5));
  const glm::mat3 m(a, b, glm::cross(a, b) + a);
  const glm::mat3 n(b, a + b, 2.0f * a);
  const simd::mat3 lane_m{simd::vec3(m[0]), simd::vec3(m[1]), simd::vec3(m[2])};
  const simd::mat3 lane_n{simd::vec3(n[0]), simd::vec3(n[1]), simd::vec3(n[2])};
  const auto expect_near = [](const simd::vec3& found, const glm::vec3& expected) {
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(found[static_cast<uint32_t>(axis)].v[kLanes - 1], expected[axis], 1e-6f);
  };
  expect_near(lane_m * simd::vec3(a), m * a);
  expect_near(simd::vec3(a) * lane_m, a * m);
  for (uint32_t column = 0; column < 3; ++column) {
    const auto c = static_cast<int>(column);
    expect_near((lane_m * lane_n)[column], (m * n)[c]);
    expect_near(simd::transpose(lane_m)[column], glm::transpose(m)[c]);
    expect_near(simd::outerProduct(simd::vec3(a), simd::vec3(b))[column], glm::outerProduct(a, b)[c]);
  }
}

TEST(Lanes, HashesAreThoseOfTheRest) {
  for (const uint32_t x : {0u, 1u, 77u, 0xdeadbeefu})
    for (uint32_t lane = 0; lane < kLanes; ++lane)
      EXPECT_EQ(law::mix_u32(simd::Uint(x)).v[lane], mix_u32(x)) << x;
}

// However far apart its points are, as much of a strand is hidden in the skin.
TEST(Laws, StrandsComeOutOfTheSkinAlikeForAnySteps) {
  const auto cover_between = [](float step) {
    const auto cover_at = [&](float along) {
      return law::strand_cover(simd::Float(along), simd::Float(step), simd::Float(0.1f)).v[0];
    };
    constexpr float kEnd = 0.24f;
    double sum = 0.0;
    const int steps = static_cast<int>(std::lround(kEnd / step));
    for (int i = 0; i < steps; ++i) {
      const float from = step * static_cast<float>(i);
      sum += 0.5 * step * (cover_at(from) + cover_at(from + step));
    }
    EXPECT_EQ(cover_at(kEnd), 1.0f);
    EXPECT_LT(cover_at(0.0f), 1.0f);
    return sum / kEnd;
  };
  const double fine = cover_between(0.001f);
  EXPECT_LT(fine, 1.0);
  for (const float step : {0.01f, 0.03f, 0.06f, 0.12f}) EXPECT_NEAR(cover_between(step), fine, 1e-4) << step;
}

}  // namespace
}  // namespace strandcast::lanes_test

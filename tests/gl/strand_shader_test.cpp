// The functions of shaders/lib that strands are made of, run on the GPU against equations in double
// precision.
#include <cmath>

#include "tests/support/shader_probe.h"
#include "tests/support/strand_reference.h"

namespace strandcast::strand_shader_test {
namespace {

using StrandShader = ShaderProbe;

TEST_F(StrandShader, CoverageSummedAcrossALineIsItsWidth) {
  // A line at any angle crosses pixel columns at every offset: sum over pixels, mean over offsets.
  std::vector<std::vector<glm::vec4>> rows;
  const std::vector<double> widths{0.02, 0.05, 0.1, 0.25, 0.5, 1.0, 1.7, 3.0};
  for (const double width : widths)
    for (int offset = 0; offset < 8; ++offset) rows.push_back({glm::vec4(width, offset / 8.0, 0, 0)});
  const auto sums =
      evaluate({"lib/coverage.glsl"},
               "float sum = 0.0;\n"
               "for (int i = -6; i <= 6; ++i) sum += line_coverage(a(0u).x, float(i) + a(0u).y);\n"
               "return vec4(sum, line_coverage(a(0u).x, a(0u).y), 0.0, 0.0);\n",
               rows);
  for (size_t i = 0; i < rows.size(); ++i) {
    const double width = widths[i / 8];
    EXPECT_NEAR(sums[i].x, width, 0.02 * width);
    EXPECT_NEAR(sums[i].y, reference::line_coverage(width, (i % 8) / 8.0), 1e-5);
  }
}

TEST_F(StrandShader, CoverageThresholdsSpreadEvenly) {
  // Any share of coverage is met by that share of the pixels of a 32 x 32 block, for any strand.
  const auto shares =
      evaluate({"lib/coverage.glsl"},
               "float hits = 0.0;\n"
               "for (int y = 0; y < 32; ++y) for (int x = 0; x < 32; ++x)\n"
               "  if (a(0u).x > coverage_threshold(vec2(x, y) + 0.5, a(0u).y)) hits += 1.0;\n"
               "return vec4(hits / 1024.0);\n",
               {{glm::vec4(0.1, 0.0, 0, 0)}, {glm::vec4(0.25, 0.3, 0, 0)}, {glm::vec4(0.7, 0.9, 0, 0)}});
  EXPECT_NEAR(shares[0].x, 0.1, 0.01);
  EXPECT_NEAR(shares[1].x, 0.25, 0.01);
  EXPECT_NEAR(shares[2].x, 0.7, 0.01);
}

TEST_F(StrandShader, MomentsOfTwoLayersTellWhatPassesEach) {
  // Opacities 0.5 and 0.4 at -0.5 and 0.4: all passes in front, 0.5 between, 0.3 behind both.
  std::vector<std::vector<glm::vec4>> rows;
  const std::vector<std::pair<double, double>> expected{{-0.9, 1.0}, {-0.6, 1.0}, {-0.3, 0.5}, {0.0, 0.5},
                                                        {0.3, 0.5},  {0.5, 0.3},  {0.9, 0.3}};
  double b0 = 0.0;
  glm::dvec4 moments(0.0);
  for (const auto& [z, opacity] : {std::pair(-0.5, 0.5), std::pair(0.4, 0.4)}) {
    const double absorbance = -std::log(1.0 - opacity);
    b0 += absorbance;
    moments += absorbance * glm::dvec4(z, z * z, z * z * z, z * z * z * z);
  }
  for (const auto& [z, passing] : expected) rows.push_back({glm::vec4(z, b0, 0, 0), glm::vec4(moments)});
  const auto values =
      evaluate({"lib/moments.glsl"}, "return vec4(transmittance_at(a(0u).x, a(0u).y, a(1u), 0.1));\n", rows);
  for (size_t i = 0; i < rows.size(); ++i)
    EXPECT_NEAR(values[i].x, expected[i].second, 2e-3) << expected[i].first;
}

TEST_F(StrandShader, OpacitiesMultiplyAsIntegers) {
  // A hundred layers of each opacity, and one in front of an opaque one.
  std::vector<std::vector<glm::vec4>> rows;
  for (const float opacity : {0.0005f, 0.01f, 0.3f, 0.9f, 1.0f}) rows.push_back({glm::vec4(opacity)});
  const auto values = evaluate({"lib/opacity_sum.glsl"},
                               "uint one = opacity_log(a(0u).x);\n"
                               "return vec4(transmitted(one), transmitted(100u * one),\n"
                               "            transmitted(one + opacity_log(a(0u).x * 0.0 + 1.0)), 0.0);\n",
                               rows);
  for (size_t i = 0; i < rows.size(); ++i) {
    const double passing = 1.0 - rows[i][0].x;
    EXPECT_NEAR(values[i].x, passing, 2e-5);
    EXPECT_NEAR(values[i].y, std::pow(passing, 100), 1e-3);
    EXPECT_NEAR(values[i].z, 0.0, 2e-5);
  }
}

TEST_F(StrandShader, FollowerWeightsAreTheHashedOnesInsideTheTriangle) {
  std::vector<std::vector<glm::vec4>> rows;
  for (int i = 0; i < 4096; ++i) rows.push_back({glm::vec4(i, 0, 0, 0)});
  const auto weights =
      evaluate({"lib/follower.glsl"}, "return vec4(follower_weights(uint(a(0u).x)), 0.0);\n", rows);
  glm::dvec3 mean(0.0);
  for (uint32_t i = 0; i < 4096; ++i) {
    const glm::dvec3 expected = reference::follower_weights(i);
    for (int corner = 0; corner < 3; ++corner) {
      EXPECT_NEAR(weights[i][corner], expected[corner], 1e-6);
      EXPECT_GE(weights[i][corner], 0.0f);
    }
    EXPECT_NEAR(weights[i].x + weights[i].y + weights[i].z, 1.0f, 1e-6f);
    mean += glm::dvec3(weights[i]) / 4096.0;
  }
  // Uniform over the triangle: the mean is the centroid, each weight with standard deviation 1 / sqrt(18).
  for (int corner = 0; corner < 3; ++corner)
    EXPECT_NEAR(mean[corner], 1.0 / 3.0, 4.0 / std::sqrt(18.0 * 4096.0));
}

TEST_F(StrandShader, ASingleWeightReturnsTheKeyBitForBit) {
  const glm::vec4 a(0.1f, -0.2f, 0.3f, 0), b(7, 8, 9, 0), c(-1, -2, 3e5f, 0);
  const auto values =
      evaluate({"lib/follower.glsl"},
               "return vec4(interpolate_keys(clumped_weights(vec3(1, 0, 0), a(3u).x), a(0u).xyz, "
               "a(1u).xyz, a(2u).xyz), 0.0);\n",
               {{a, b, c, glm::vec4(0)}, {a, b, c, glm::vec4(0.37f)}, {a, b, c, glm::vec4(1)}});
  for (const glm::vec4& value : values) EXPECT_EQ(glm::vec3(value), glm::vec3(a));
}

TEST_F(StrandShader, SrgbHasItsFixedPoints) {
  const auto values = evaluate({"lib/tone.glsl"}, "return vec4(srgb_from_linear(a(0u).xyz), 0.0);\n",
                               {{glm::vec4(0.0, 0.0031308, 0.214041, 0)}, {glm::vec4(1.0, 0.5, 0.001, 0)}});
  EXPECT_NEAR(values[0].x, 0.0, 1e-6);
  EXPECT_NEAR(values[0].y, 0.04045, 1e-4);
  EXPECT_NEAR(values[0].z, 0.5, 1e-4);
  EXPECT_NEAR(values[1].x, 1.0, 1e-4);
  EXPECT_NEAR(values[1].y, 0.735357, 1e-4);
  EXPECT_NEAR(values[1].z, 0.01292, 1e-5);
}

}  // namespace
}  // namespace strandcast::strand_shader_test

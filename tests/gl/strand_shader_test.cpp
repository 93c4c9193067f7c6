// The functions of shaders/lib that strands are made of, run on the GPU against equations in double
// precision.
#include <epoxy/gl.h>

#include <cmath>
#include <filesystem>
#include <random>

#include "common/gl/objects.h"
#include "common/gl/program.h"
#include "tests/support/gl_fixture.h"
#include "tests/support/strand_reference.h"
#include "tests/support/temporary_folder.h"

namespace strandcast {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegree = kPi / 180.0;

glm::dvec3 at_angle(double degrees) {
  return {std::cos(degrees * kDegree), std::sin(degrees * kDegree), 0.0};
}

class StrandShader : public GlTest {
 protected:
  // Evaluates `body`, which returns a vec4 from `a(0)`, `a(1)`, ... of one invocation, for every row of
  // inputs.
  std::vector<glm::vec4> evaluate(const std::string& include, const std::string& body,
                                  const std::vector<std::vector<glm::vec4>>& rows) {
    const auto shaders = std::filesystem::path(STRANDCAST_SOURCE_DIR) / "shaders";
    std::filesystem::copy(
        shaders / "lib", folder_.path() / "lib",
        std::filesystem::copy_options::recursive | std::filesystem::copy_options::overwrite_existing);
    folder_.write("probe.comp",
                  "#include \"lib/" + include + "\"\n" +
                      "layout(local_size_x = 32) in;\n"
                      "layout(std430, binding = 0) readonly buffer In { vec4 v[]; } inputs;\n"
                      "layout(std430, binding = 1) buffer Out { vec4 v[]; } outputs;\n"
                      "uniform uint u_columns;\n"
                      "vec4 a(uint i) { return inputs.v[gl_GlobalInvocationID.x * u_columns + i]; }\n"
                      "vec4 probe() {\n" +
                      body +
                      "}\n"
                      "void main() { outputs.v[gl_GlobalInvocationID.x] = probe(); }\n");
    auto program = gl::Program::make(gl::ShaderLibrary(folder_.path()), {"probe.comp"}, {});
    if (!program) {
      ADD_FAILURE() << program.error().to_string();
      return std::vector<glm::vec4>(rows.size());
    }
    std::vector<glm::vec4> flat;
    const size_t padded = (rows.size() + 31) / 32 * 32;
    for (size_t row = 0; row < padded; ++row)
      for (const glm::vec4& value : rows[std::min(row, rows.size() - 1)]) flat.push_back(value);
    const gl::Buffer inputs = gl::Buffer::of("in", flat);
    const gl::Buffer outputs("out", padded * sizeof(glm::vec4));
    program->use();
    program->set("u_columns", static_cast<uint32_t>(rows.front().size()));
    inputs.bind_storage(0);
    outputs.bind_storage(1);
    glDispatchCompute(static_cast<GLuint>(padded / 32), 1, 1);
    auto result = outputs.read_all<glm::vec4>();
    result.resize(rows.size());
    return result;
  }

  TemporaryFolder folder_;
};

TEST_F(StrandShader, CoverageSummedAcrossALineIsItsWidth) {
  // A line at any angle crosses pixel columns at every offset: sum over pixels, mean over offsets.
  std::vector<std::vector<glm::vec4>> rows;
  const std::vector<double> widths{0.02, 0.05, 0.1, 0.25, 0.5, 1.0, 1.7, 3.0};
  for (const double width : widths)
    for (int offset = 0; offset < 8; ++offset) rows.push_back({glm::vec4(width, offset / 8.0, 0, 0)});
  const auto sums =
      evaluate("coverage.glsl",
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
      evaluate("coverage.glsl",
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
      evaluate("moments.glsl", "return vec4(transmittance_at(a(0u).x, a(0u).y, a(1u), 0.1));\n", rows);
  for (size_t i = 0; i < rows.size(); ++i)
    EXPECT_NEAR(values[i].x, expected[i].second, 2e-3) << expected[i].first;
}

TEST_F(StrandShader, OpacitiesMultiplyAsIntegers) {
  // A hundred layers of each opacity.
  std::vector<std::vector<glm::vec4>> rows;
  for (const float opacity : {0.0005f, 0.01f, 0.3f, 0.9f, 1.0f}) rows.push_back({glm::vec4(opacity)});
  const auto values =
      evaluate("opacity_sum.glsl",
               "return vec4(transmitted(opacity_log(a(0u).x)), transmitted(100u * opacity_log(a(0u).x)),\n"
               "            0.0, 0.0);\n",
               rows);
  for (size_t i = 0; i < rows.size(); ++i) {
    const double passing = 1.0 - rows[i][0].x;
    EXPECT_NEAR(values[i].x, passing, 2e-5);
    EXPECT_NEAR(values[i].y, std::pow(passing, 100), 1e-3);
  }
}

TEST_F(StrandShader, KajiyaKayHasItsPublishedValues) {
  // T.L = cos 60, p = 20: T.V = cos 120 is the mirror direction, 10 degrees off it is cos^20 of 10 degrees.
  const glm::vec4 tangent(1, 0, 0, 0);
  const glm::vec4 light(glm::vec3(at_angle(60)), 0);
  const auto row = [&](double eye) {
    return std::vector<glm::vec4>{tangent, light, glm::vec4(glm::vec3(at_angle(eye)), 0)};
  };
  const auto values = evaluate("strand_shading.glsl",
                               "return vec4(kajiya_kay_specular(a(0u).xyz, a(1u).xyz, a(2u).xyz, 20.0),\n"
                               "            kajiya_kay_diffuse(a(0u).xyz, a(1u).xyz), 0.0, 0.0);\n",
                               {row(120), row(110), row(60)});
  EXPECT_NEAR(values[0].x, 1.0, 1e-4);
  EXPECT_NEAR(values[1].x, 0.736257, 1e-4);
  EXPECT_NEAR(values[2].x, 1e-6, 1e-6);
  EXPECT_NEAR(values[0].y, 0.866025, 1e-5);
}

TEST_F(StrandShader, LobesMatchTheEquationsEverywhere) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const auto direction = [&] {
    return glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
  };
  std::vector<std::vector<glm::vec4>> rows;
  std::vector<glm::dvec3> expected;
  while (rows.size() < 4096) {
    const glm::dvec3 tangent = direction(), light = direction(), eye = direction();
    // Along the strand there is no azimuth: the shader clamps there.
    if (std::abs(glm::dot(tangent, light)) > 0.98 || std::abs(glm::dot(tangent, eye)) > 0.98) continue;
    const double glint = 30.0 * kDegree + 15.0 * kDegree * (rows.size() % 16) / 16.0;
    rows.push_back(
        {glm::vec4(glm::vec3(tangent), glint), glm::vec4(glm::vec3(light), 0), glm::vec4(glm::vec3(eye), 0)});
    expected.push_back(reference::sadeghi_lobes(tangent, light, eye, glint));
  }
  const auto lobes = evaluate(
      "strand_shading.glsl",
      "return vec4(sadeghi_lobes(scatter_angles(a(0u).xyz, a(1u).xyz, a(2u).xyz), a(0u).w), 0.0);\n", rows);
  for (size_t i = 0; i < rows.size(); ++i)
    for (int lobe = 0; lobe < 3; ++lobe)
      EXPECT_NEAR(lobes[i][lobe], expected[i][lobe], 0.01 * expected[i][lobe] + 0.02) << "lobe " << lobe;
}

TEST_F(StrandShader, ThePrimaryHighlightIsShiftedTowardsTheRoot) {
  // Light straight across. At half angle h the lobe is exp(-(h - shift)^2 / 2 width^2) / cos^2 h, with its
  // peak at h - shift = 2 width^2 tan h: -7.25 degrees for R (towards the root), 12.2 degrees for TRT. Twice
  // that is the view.
  std::vector<std::vector<glm::vec4>> rows;
  for (int degrees = -60; degrees <= 60; ++degrees)
    rows.push_back({glm::vec4(1, 0, 0, 35.0 * kDegree), glm::vec4(0, 1, 0, 0),
                    glm::vec4(std::sin(degrees * kDegree), std::cos(degrees * kDegree), 0, 0)});
  const auto lobes = evaluate(
      "strand_shading.glsl",
      "return vec4(sadeghi_lobes(scatter_angles(a(0u).xyz, a(1u).xyz, a(2u).xyz), a(0u).w), 0.0);\n", rows);
  int peak_r = 0, peak_trt = 0;
  for (size_t i = 1; i < lobes.size(); ++i) {
    if (lobes[i].x > lobes[peak_r].x) peak_r = static_cast<int>(i);
    if (lobes[i].z > lobes[peak_trt].z) peak_trt = static_cast<int>(i);
  }
  EXPECT_NEAR(peak_r - 60, -14.5, 1);
  EXPECT_NEAR(peak_trt - 60, 24.4, 1);
}

TEST_F(StrandShader, DegenerateDirectionsStayFinite) {
  const glm::vec4 x(1, 0, 0, 0.6f);
  const auto lobes =
      evaluate("strand_shading.glsl",
               "return vec4(sadeghi_lobes(scatter_angles(a(0u).xyz, a(1u).xyz, a(2u).xyz), a(0u).w), 0.0);\n",
               {{x, x, x}, {x, -x, x}, {x, -x, -x}, {x, x, glm::vec4(0, 1, 0, 0)}});
  for (const glm::vec4& value : lobes)
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(std::isfinite(value[i]) && value[i] >= 0.0f);
}

TEST_F(StrandShader, FollowerWeightsAreTheHashedOnesInsideTheTriangle) {
  std::vector<std::vector<glm::vec4>> rows;
  for (int i = 0; i < 4096; ++i) rows.push_back({glm::vec4(i, 0, 0, 0)});
  const auto weights =
      evaluate("follower.glsl", "return vec4(follower_weights(uint(a(0u).x)), 0.0);\n", rows);
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
      evaluate("follower.glsl",
               "return vec4(interpolate_keys(clumped_weights(vec3(1, 0, 0), a(3u).x), a(0u).xyz, "
               "a(1u).xyz, a(2u).xyz), 0.0);\n",
               {{a, b, c, glm::vec4(0)}, {a, b, c, glm::vec4(0.37f)}, {a, b, c, glm::vec4(1)}});
  for (const glm::vec4& value : values) EXPECT_EQ(glm::vec3(value), glm::vec3(a));
}

TEST_F(StrandShader, SrgbHasItsFixedPoints) {
  const auto values = evaluate("tone.glsl", "return vec4(srgb_from_linear(a(0u).xyz), 0.0);\n",
                               {{glm::vec4(0.0, 0.0031308, 0.214041, 0)}, {glm::vec4(1.0, 0.5, 0.001, 0)}});
  EXPECT_NEAR(values[0].x, 0.0, 1e-6);
  EXPECT_NEAR(values[0].y, 0.04045, 1e-4);
  EXPECT_NEAR(values[0].z, 0.5, 1e-4);
  EXPECT_NEAR(values[1].x, 1.0, 1e-4);
  EXPECT_NEAR(values[1].y, 0.735357, 1e-4);
  EXPECT_NEAR(values[1].z, 0.01292, 1e-5);
}

}  // namespace
}  // namespace strandcast

// Every way to smooth edges: a strand covers its width, and samples by density save only where nothing is
// lost.

#include <epoxy/gl.h>

#include <cmath>
#include <random>

#include "common/render/renderer.h"
#include "tests/support/gl_fixture.h"

namespace strandcast::antialiasing_test {
namespace {

constexpr RenderSize kSize{160, 90};
constexpr float kPxPerM = 200.0f;
constexpr float kBackground = 0.3f;
constexpr AntialiasingMethod kAll[] = {AntialiasingMethod::Analytic, AntialiasingMethod::Msaa4,
                                       AntialiasingMethod::DensitySamples};

std::string name_of(AntialiasingMethod method) {
  return std::string(antialiasing_methods().rows()[static_cast<size_t>(method)].name);
}

CameraDesc camera() {
  CameraDesc camera;
  camera.offset_m = {0.0f, 0.0f, 1.0f};
  camera.target_m = {0.0f, 0.0f, 0.0f};
  camera.fov_y_rad = 2.0f * std::atan(0.5f * kSize.height / kPxPerM);
  return camera;
}

/// Black strands.
LookDesc black(float width_px) {
  LookDesc look;
  look.strand_radius_m = 0.5f * width_px / kPxPerM;
  look.tip_scale = 1.0f;
  look.ambient = 0.0f;
  look.light_color = glm::vec3(0.0f);
  look.background = glm::vec3(kBackground);
  return look;
}

SceneAsset strands_of(const std::vector<std::vector<glm::vec3>>& strands) {
  SceneAsset asset;
  asset.strand_count = static_cast<uint32_t>(strands.size());
  asset.vertex_count = static_cast<uint32_t>(strands.front().size());
  for (uint32_t v = 0; v < asset.vertex_count; ++v)
    for (const auto& strand : strands) asset.rest_position_m.push_back(strand[v]);
  return asset;
}

double linear(uint8_t srgb) {
  const double value = srgb / 255.0;
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

class AntialiasingTest : public GlTest {
 protected:
  void TearDown() override { EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR)); }

  Image draw(const SceneAsset& asset, const LookDesc& look, AntialiasingMethod method,
             RenderSize size = kSize) {
    auto renderer =
        Renderer::make(gl::ShaderLibrary(), context_->info(), asset, look,
                       segment_path_with({ShadowMethod::Volume, TransparencyMethod::Hashed, method}));
    if (!renderer) {
      ADD_FAILURE() << renderer.error().to_string();
      return {};
    }
    const Status status = (*renderer)->draw({{}, asset.rest_position_m}, camera(), size);
    EXPECT_TRUE(status) << status.error().to_string();
    return (*renderer)->read_image();
  }

  /// Pixels that black strands cover, in parts.
  double covered_px(const SceneAsset& asset, float width_px, AntialiasingMethod method) {
    const Image image = draw(asset, black(width_px), method);
    const Image empty = draw(SceneAsset{}, black(width_px), AntialiasingMethod::Analytic);
    double sum = 0.0;
    for (size_t i = 0; i < image.rgba.size(); i += 4)
      sum += 1.0 - linear(image.rgba[i]) / linear(empty.rgba[i]);
    return sum;
  }
};

TEST_F(AntialiasingTest, AStrandCoversItsWidth) {
  for (const AntialiasingMethod method : kAll)
    for (const float width_px : {0.3f, 1.0f, 3.0f})
      for (const float lean : {0.0f, 0.3f, 1.0f}) {
        const glm::vec3 tip(0.2f * lean + 0.001f, 0.15f, 0.0f);
        const SceneAsset asset = strands_of({{-tip, glm::vec3(0.0f, 0.0f, 1e-4f), tip}});
        const double expected = 2.0 * glm::length(tip) * kPxPerM * width_px;
        EXPECT_NEAR(covered_px(asset, width_px, method), expected, 0.1 * expected)
            << name_of(method) << ", " << width_px << " px, " << lean;
      }
}

TEST_F(AntialiasingTest, StrandsWithNothingBehindThemHaveAllTheirSamples) {
  std::vector<std::vector<glm::vec3>> strands;
  for (int i = 0; i < 20; ++i) {
    const float x = 0.01f * static_cast<float>(i) - 0.1f;
    strands.push_back({{x, 0.1f, 0.0f}, {x + 0.01f, 0.0f, 0.0f}, {x + 0.03f, -0.1f, 0.0f}});
  }
  const SceneAsset asset = strands_of(strands);
  EXPECT_EQ(draw(asset, black(0.5f), AntialiasingMethod::DensitySamples).rgba,
            draw(asset, black(0.5f), AntialiasingMethod::Analytic).rgba);
}

/// A ball of short strands, in front of as many more as go through it.
SceneAsset ball(size_t count) {
  std::mt19937 random(6);
  std::normal_distribution<float> normal;
  const auto point = [&] {
    const glm::vec3 way(normal(random), normal(random), normal(random));
    return 0.1f * std::cbrt(std::uniform_real_distribution<float>(0.0f, 1.0f)(random)) * glm::normalize(way);
  };
  std::vector<std::vector<glm::vec3>> strands;
  for (size_t i = 0; i < count; ++i) {
    const glm::vec3 root = point();
    const glm::vec3 tip = root + 0.2f * point();
    strands.push_back({root, 0.5f * (root + tip), tip});
  }
  return strands_of(strands);
}

TEST_F(AntialiasingTest, SamplesBelongToTheEdgeOfTheHair) {
  LookDesc look = black(0.5f);
  look.ambient = 1.0f;
  look.light_color = glm::vec3(1.0f);
  const SceneAsset asset = ball(6000);
  const Image analytic = draw(asset, look, AntialiasingMethod::Analytic);
  const Image by_density = draw(asset, look, AntialiasingMethod::DensitySamples);
  ASSERT_EQ(analytic.rgba.size(), by_density.rgba.size());
  // The ball has a radius of 20 pixels round the middle, and an optical depth of 3.4 through it; 3 is deep.
  double inner = 0.0, rim = 0.0, sum = 0.0, reference = 0.0;
  for (uint32_t y = 0; y < kSize.height; ++y)
    for (uint32_t x = 0; x < kSize.width; ++x) {
      const size_t i = 4 * (size_t{y} * kSize.width + x);
      const double difference = std::abs(analytic.rgba[i] - by_density.rgba[i]);
      const double radius = std::hypot(x - 79.5, y - 44.5);
      if (radius < 8.0) inner += difference;
      if (radius > 17.0) rim += difference;
      sum += by_density.rgba[i];
      reference += analytic.rgba[i];
    }
  EXPECT_GT(inner, 0.0) << "no strand had fewer samples";
  EXPECT_EQ(rim, 0.0) << "the edge lost samples";
  EXPECT_NEAR(sum / reference, 1.0, 0.01);
}

TEST_F(AntialiasingTest, APictureOfOnePixelIsDrawn) {
  for (const AntialiasingMethod method : kAll)
    EXPECT_EQ(draw(ball(50), black(1.0f), method, {1, 1}).rgba.size(), 4u) << name_of(method);
}

}  // namespace
}  // namespace strandcast::antialiasing_test

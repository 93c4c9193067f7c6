// What makes a picture of hair look like hair, as laws on statistics: depth, light that comes from somewhere,
// shadow, highlights. The groom is grown, small, and drawn at rest.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/groom/groom_asset.h"
#include "common/groom/mesh.h"
#include "common/groom/procedural.h"
#include "common/render/renderer.h"
#include "tests/support/gl_fixture.h"

namespace strandcast::render_look_test {
namespace {

constexpr RenderSize kSize{240, 240};
constexpr float kHeadRadiusM = 0.095f;

class RenderLook : public GlTest {
 protected:
  static SceneAsset grown(Mesh head) {
    ProceduralGroomOptions options;
    options.strand_count = 600;
    options.vertex_count = 12;
    options.length_m = 0.2f;
    auto groom = grow_groom(make_scalp_cap(glm::vec3(0.0f), kHeadRadiusM, 1000), options);
    if (!groom) {
      ADD_FAILURE() << groom.error().to_string();
      return {};
    }
    return make_scene_asset(*groom, std::move(head));
  }

  // Seen from behind: hair fills the middle of the picture.
  static CameraDesc behind() {
    CameraDesc camera;
    camera.offset_m = {0.0f, 0.05f, -0.7f};
    camera.target_m = {0.0f, 0.0f, 0.0f};
    camera.fov_y_rad = 0.5f;
    return camera;
  }

  Image draw(const SceneAsset& asset, const LookDesc& look, const CameraDesc& camera) {
    auto renderer = Renderer::make(gl::ShaderLibrary(), context_->info(), asset, look);
    if (!renderer) {
      ADD_FAILURE() << renderer.error().to_string();
      return {};
    }
    const Status status = (*renderer)->draw({{}, asset.rest_position_m}, camera, kSize);
    EXPECT_TRUE(status) << status.error().to_string();
    return (*renderer)->read_image();
  }

  // Luminance, 0..1 as shown, of the pixels of a box given in shares of the picture.
  static std::vector<double> luminance(const Image& image, glm::vec2 low, glm::vec2 high) {
    std::vector<double> values;
    for (auto y = static_cast<uint32_t>(low.y * image.height);
         y < static_cast<uint32_t>(high.y * image.height); ++y)
      for (auto x = static_cast<uint32_t>(low.x * image.width);
           x < static_cast<uint32_t>(high.x * image.width); ++x) {
        const uint8_t* pixel = &image.rgba[4 * (static_cast<size_t>(y) * image.width + x)];
        values.push_back((0.2126 * pixel[0] + 0.7152 * pixel[1] + 0.0722 * pixel[2]) / 255.0);
      }
    return values;
  }
  static double mean(const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  }
  static double quantile(std::vector<double> values, double share) {
    std::sort(values.begin(), values.end());
    return values[static_cast<size_t>(share * static_cast<double>(values.size() - 1))];
  }
};

TEST_F(RenderLook, HairIsNeitherFlatNorBlownOut) {
  const Image image = draw(grown(make_head(kHeadRadiusM)), {}, behind());
  ASSERT_FALSE(image.rgba.empty());
  const auto hair = luminance(image, {0.35f, 0.3f}, {0.65f, 0.7f});
  EXPECT_GT(quantile(hair, 0.95) - quantile(hair, 0.05), 0.08);
  EXPECT_GT(quantile(hair, 0.02), 0.01);
  EXPECT_LT(quantile(hair, 0.999), 0.98);
}

TEST_F(RenderLook, TheLitSideIsTheBrighterOne) {
  const SceneAsset asset = grown(make_head(kHeadRadiusM));
  LookDesc look;
  look.light_direction = {1.0f, -0.3f, 0.2f};
  const Image from_left = draw(asset, look, behind());
  look.light_direction.x = -1.0f;
  const Image from_right = draw(asset, look, behind());
  // Seen from behind, world's +x is the picture's left.
  const glm::vec2 left_low(0.36f, 0.35f), left_high(0.46f, 0.65f), right_low(0.54f, 0.35f),
      right_high(0.64f, 0.65f);
  EXPECT_GT(mean(luminance(from_left, right_low, right_high)),
            mean(luminance(from_left, left_low, left_high)) + 0.03);
  EXPECT_GT(mean(luminance(from_right, left_low, left_high)),
            mean(luminance(from_right, right_low, right_high)) + 0.03);
}

TEST_F(RenderLook, HairShadowsTheHeadUnderIt) {
  CameraDesc front = behind();
  front.offset_m.z = 0.7f;
  LookDesc look;
  look.light_direction = {0.0f, -0.3f, 1.0f};  // from behind the head, through the hair
  look.skin_color = glm::vec3(0.8f);
  look.ambient = 0.3f;
  SceneAsset bald = grown(make_head(kHeadRadiusM));
  const Image with_hair = draw(bald, look, front);
  bald.strand_count = 0;
  bald.vertex_count = 0;
  bald.rest_position_m.clear();
  bald.triangle.clear();
  const Image without = draw(bald, look, front);
  // The face: no hair hangs in front of it, but less of the surroundings reaches it.
  const glm::vec2 low(0.47f, 0.5f), high(0.53f, 0.56f);
  EXPECT_LT(mean(luminance(with_hair, low, high)), mean(luminance(without, low, high)));
}

TEST_F(RenderLook, ASphereThroughAManeIsNoSkull) {
  // Roots along a long arc behind the head: the sphere through them holds the whole head, which must stay
  // lit.
  SceneAsset asset;
  asset.head = make_head(kHeadRadiusM);
  asset.strand_count = 200;
  asset.vertex_count = 2;
  for (const float radius_m : {0.3f, 0.35f})
    for (uint32_t i = 0; i < asset.strand_count; ++i) {
      const float angle = 2.0f * static_cast<float>(i) / static_cast<float>(asset.strand_count);
      const float side = 0.02f * static_cast<float>(i % 5) - 0.04f;
      asset.rest_position_m.emplace_back(side, radius_m * std::cos(angle) - 0.2f,
                                         -radius_m * std::sin(angle));
    }
  CameraDesc front = behind();
  front.offset_m.z = 0.7f;
  LookDesc look;
  look.light_direction = {0.0f, -0.1f, -1.0f};
  const Image image = draw(asset, look, front);
  ASSERT_FALSE(image.rgba.empty());
  EXPECT_GT(mean(luminance(image, {0.45f, 0.5f}, {0.55f, 0.55f})), 0.35);
}

TEST_F(RenderLook, FairHairGlowsAgainstTheLight) {
  // Transmitted light: blond hair in front of the light is brighter than dark hair by more than its colour
  // says.
  const SceneAsset asset = grown({});
  LookDesc look;
  look.ambient = 0.0f;
  look.light_direction = {0.0f, 0.0f, -1.0f};  // towards the camera behind
  look.background = glm::vec3(0.0f);
  look.root_color = look.tip_color = glm::vec3(0.6f, 0.45f, 0.25f);
  const double fair = quantile(luminance(draw(asset, look, behind()), {0, 0}, {1, 1}), 0.98);
  look.root_color = look.tip_color = glm::vec3(0.02f, 0.012f, 0.008f);
  const double dark = quantile(luminance(draw(asset, look, behind()), {0, 0}, {1, 1}), 0.98);
  EXPECT_GT(fair, 0.3);
  EXPECT_LT(dark, 0.5 * fair);
}

// Light straight across the strands: what is reflected at once leaves towards the root, what went through and
// back leaves towards the tip, by 24 degrees (strand_shader_test.cpp). The second is stronger on fair hair.
TEST_F(RenderLook, FairHairShinesTowardsTheTip) {
  constexpr float kAwayM = 0.7f;
  const float tilt_rad = glm::radians(24.0f);
  SceneAsset asset;  // a curtain, roots above
  asset.strand_count = 400;
  asset.vertex_count = 3;
  for (uint32_t v = 0; v < asset.vertex_count; ++v)
    for (uint32_t s = 0; s < asset.strand_count; ++s)
      asset.rest_position_m.emplace_back(5e-4f * static_cast<float>(s) - 0.1f,
                                         0.1f - 0.1f * static_cast<float>(v), 0.0f);
  LookDesc look;
  look.ambient = 0.0f;
  look.background = glm::vec3(0.0f);
  look.light_direction = {0.0f, 0.0f, -1.0f};  // from the side of the camera
  look.root_color = look.tip_color = glm::vec3(0.5f);
  const auto seen_from = [&](float side) {
    CameraDesc camera = behind();
    camera.offset_m = kAwayM * glm::vec3(0.0f, side * std::sin(tilt_rad), std::cos(tilt_rad));
    return mean(luminance(draw(asset, look, camera), {0.45f, 0.45f}, {0.55f, 0.55f}));
  };
  const double from_tips = seen_from(-1.0f);
  const double from_roots = seen_from(1.0f);
  EXPECT_GT(from_tips, 1.05 * from_roots);
  fmt::print("{:.3f} from the tips' side, {:.3f} from the roots'\n", from_tips, from_roots);
}

TEST_F(RenderLook, BlocksDoNotDependOnTheSizeOfThePicture) {
  // Detail follows the size on the screen; what a block of the picture shows on average does not.
  const SceneAsset asset = grown(make_head(kHeadRadiusM));
  auto renderer = Renderer::make(gl::ShaderLibrary(), context_->info(), asset, {});
  ASSERT_TRUE(renderer) << renderer.error().to_string();
  ASSERT_TRUE((*renderer)->draw({{}, asset.rest_position_m}, behind(), {120, 120}));
  const Image small = (*renderer)->read_image();
  ASSERT_TRUE((*renderer)->draw({{}, asset.rest_position_m}, behind(), {480, 480}));
  const Image large = (*renderer)->read_image();
  constexpr int kBlocks = 6;
  for (int y = 0; y < kBlocks; ++y)
    for (int x = 0; x < kBlocks; ++x) {
      const glm::vec2 low = glm::vec2(x, y) / static_cast<float>(kBlocks);
      const glm::vec2 high = low + 1.0f / kBlocks;
      EXPECT_NEAR(mean(luminance(small, low, high)), mean(luminance(large, low, high)), 0.035)
          << x << ", " << y;
    }
}

}  // namespace
}  // namespace strandcast::render_look_test

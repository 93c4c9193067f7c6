#include "common/render/renderer.h"

#include <epoxy/gl.h>

#include <cmath>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/quaternion.hpp>

#include "tests/support/gl_fixture.h"

namespace strandcast::renderer_test {
namespace {

constexpr RenderSize kSmall{160, 90};

// A camera 1 m in front of the head that sees 0.45 m of height: 200 px per metre at kSmall.
CameraDesc front_camera() {
  CameraDesc camera;
  camera.offset_m = {0.0f, 0.0f, 1.0f};
  camera.target_m = {0.0f, 0.0f, 0.0f};
  camera.fov_y_rad = 2.0f * std::atan(0.225f);
  return camera;
}

SceneAsset empty_asset() {
  return SceneAsset{};
}

// Strands that hang down side by side, 20 cm long.
SceneAsset curtain(uint32_t strand_count, uint32_t vertex_count) {
  SceneAsset asset;
  asset.strand_count = strand_count;
  asset.vertex_count = vertex_count;
  for (uint32_t v = 0; v < vertex_count; ++v)
    for (uint32_t s = 0; s < strand_count; ++s)
      asset.rest_position_m.emplace_back(
          0.2f * (static_cast<float>(s) + 0.5f) / static_cast<float>(strand_count) - 0.1f,
          0.1f - 0.2f * static_cast<float>(v) / static_cast<float>(vertex_count - 1),
          0.01f * static_cast<float>(s % 3));
  for (uint32_t s = 0; s + 2 < strand_count; ++s) asset.triangle.emplace_back(s, s + 1, s + 2);
  return asset;
}

Mesh octahedron(float radius_m) {
  Mesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (const float sign : {1.0f, -1.0f}) {
      glm::vec3 normal(0.0f);
      normal[axis] = sign;
      mesh.normal.push_back(normal);
      mesh.position_m.push_back(radius_m * normal);
    }
  mesh.triangle = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  return mesh;
}

double luminance(const Image& image, uint32_t x, uint32_t y) {
  const uint8_t* pixel = &image.rgba[4 * (static_cast<size_t>(y) * image.width + x)];
  return (0.2126 * pixel[0] + 0.7152 * pixel[1] + 0.0722 * pixel[2]) / 255.0;
}

size_t differing_pixels(const Image& a, const Image& b) {
  EXPECT_EQ(a.rgba.size(), b.rgba.size());
  size_t count = 0;
  for (size_t i = 0; i < a.rgba.size() && i < b.rgba.size(); i += 4)
    if (!std::equal(&a.rgba[i], &a.rgba[i] + 4, &b.rgba[i])) ++count;
  return count;
}

class RendererTest : public GlTest {
 protected:
  void TearDown() override { EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR)); }

  std::unique_ptr<Renderer> make_renderer(const SceneAsset& asset, const LookDesc& look = {}) {
    auto made = Renderer::make(gl::ShaderLibrary(), context_->info(), asset, look);
    if (!made) {
      ADD_FAILURE() << made.error().to_string();
      return nullptr;
    }
    return std::move(*made);
  }

  Image draw(Renderer& renderer, const PosedStrands& strands, const CameraDesc& camera,
             RenderSize size = kSmall) {
    const Status status = renderer.draw(strands, camera, size);
    EXPECT_TRUE(status) << status.error().to_string();
    return renderer.read_image();
  }

  Image draw_at_rest(const SceneAsset& asset, const LookDesc& look = {}) {
    const auto renderer = make_renderer(asset, look);
    return renderer ? draw(*renderer, {{}, asset.rest_position_m}, front_camera()) : Image{};
  }
};

TEST_F(RendererTest, AnEmptySceneShowsTheBackgroundLighterAtTheTop) {
  LookDesc look;
  look.background = {0.2f, 0.2f, 0.2f};
  const Image image = draw_at_rest(empty_asset(), look);
  ASSERT_EQ(image.rgba.size(), 160u * 90u * 4u);
  // sRGB of 0.2 is 0.4845; the middle rows lie on it.
  EXPECT_NEAR(luminance(image, 80, 45), 0.4845, 0.01);
  EXPECT_GT(luminance(image, 80, 0), luminance(image, 80, 89) + 0.05);
  for (size_t i = 3; i < image.rgba.size(); i += 4) ASSERT_EQ(image.rgba[i], 255);
}

TEST_F(RendererTest, WhereNothingIsDrawnABackdropStaysAsItIs) {
  SceneAsset asset = curtain(20, 8);
  asset.head = octahedron(0.1f);
  Image behind{kSmall.width, kSmall.height, {}};
  for (uint32_t i = 0; i < kSmall.width * kSmall.height; ++i)
    for (const uint32_t value : {i, i / 7, 255 - i, 255u}) behind.rgba.push_back(static_cast<uint8_t>(value));
  DrawTerms over;
  over.backdrop = &behind;
  for (const RenderPath* path : {&segment_path(), &tile_path()}) {
    const auto renderer = Renderer::make(gl::ShaderLibrary(), context_->info(), asset, {}, *path);
    ASSERT_TRUE(renderer) << renderer.error().to_string();
    const auto draw_over = [&](const DrawTerms& terms) {
      EXPECT_TRUE((*renderer)->draw({{}, asset.rest_position_m}, front_camera(), kSmall, terms));
      return (*renderer)->read_image();
    };
    const Image plain = draw_over({});
    const Image image = draw_over(over);
    // 0.1 m are 20 px: hair and head are in the middle, and nothing beside them.
    for (uint32_t y = 0; y < kSmall.height; ++y)
      for (uint32_t x = 0; x < 50; ++x) {
        const size_t at = 4 * (size_t{y} * kSmall.width + x);
        ASSERT_TRUE(std::equal(&image.rgba[at], &image.rgba[at] + 4, &behind.rgba[at])) << path->name << x;
      }
    const size_t middle = 4 * (size_t{45} * kSmall.width + 80);
    for (size_t i = middle; i < middle + 3; ++i) EXPECT_NEAR(image.rgba[i], plain.rgba[i], 2) << path->name;
    EXPECT_EQ(differing_pixels(draw_over({}), plain), 0u) << "and leaves nothing behind";
  }
}

TEST_F(RendererTest, ABaldHeadIsDrawnWhereItIs) {
  SceneAsset asset = empty_asset();
  asset.head = octahedron(0.1f);
  const Image bald = draw_at_rest(asset);
  const Image empty = draw_at_rest(empty_asset());
  // 0.1 m are about 20 px: inside changes, outside does not.
  EXPECT_NE(luminance(bald, 80, 45), luminance(empty, 80, 45));
  EXPECT_EQ(luminance(bald, 80, 10), luminance(empty, 80, 10));
  EXPECT_EQ(luminance(bald, 130, 45), luminance(empty, 130, 45));
  EXPECT_NEAR(static_cast<double>(differing_pixels(bald, empty)), 2.0 * 20.0 * 20.0, 120.0);
}

TEST_F(RendererTest, OneStrandCoversItsWidth) {
  // A black strand 3 px wide and 40 px long over a grey background of height-independent middle rows.
  SceneAsset asset = curtain(1, 8);
  asset.triangle.clear();
  LookDesc look;
  look.strand_radius_m = 0.0075f;  // 3 px across at 200 px per metre
  look.tip_scale = 1.0f;
  look.ambient = 0.0f;
  look.light_color = glm::vec3(0.0f);
  look.background = {0.3f, 0.3f, 0.3f};
  const Image strand = draw_at_rest(asset, look);
  const Image empty = draw_at_rest(empty_asset(), look);
  ASSERT_FALSE(strand.rgba.empty());
  // Rows well inside of the strand, in linear light: the missing light is the covered width.
  const auto linear = [](double srgb) { return std::pow((srgb + 0.055) / 1.055, 2.4); };
  double covered = 0.0;
  for (uint32_t y = 30; y < 60; ++y)
    for (uint32_t x = 0; x < 160; ++x)
      covered += 1.0 - linear(luminance(strand, x, y)) / linear(luminance(empty, x, y));
  EXPECT_NEAR(covered / 30.0, 3.0, 0.06);
}

TEST_F(RendererTest, TwoContextsGiveTheSameBytes) {
  SceneAsset asset = curtain(60, 8);
  asset.head = octahedron(0.08f);
  const auto first = make_renderer(asset);
  ASSERT_TRUE(first);
  PosedStrands strands{{}, asset.rest_position_m};
  strands.world_from_head.rotation = glm::angleAxis(0.4, glm::normalize(glm::dvec3(0.1, 1.0, 0.2)));
  const Image a = draw(*first, strands, front_camera());
  EXPECT_EQ(draw(*first, strands, front_camera()), a);

  const auto other_context = gl::EglContext::make("auto");
  ASSERT_TRUE(other_context);
  {
    const auto second = make_renderer(asset);
    ASSERT_TRUE(second);
    // What was drawn before leaves nothing behind.
    draw(*second, {{}, asset.rest_position_m}, front_camera(), {64, 200});
    EXPECT_EQ(draw(*second, strands, front_camera()), a);
  }
  ASSERT_TRUE(context_->make_current());
}

TEST_F(RendererTest, ThePictureDoesNotDependOnWhereInTheWorldTheHeadIs) {
  const SceneAsset asset = curtain(40, 6);
  const auto renderer = make_renderer(asset);
  ASSERT_TRUE(renderer);
  PosedStrands strands{{}, asset.rest_position_m};
  const Image here = draw(*renderer, strands, front_camera());
  strands.world_from_head.position_m = {1.0e6, -3.0e5, 777.7};
  EXPECT_EQ(draw(*renderer, strands, front_camera()), here);
}

TEST_F(RendererTest, AHalfTurnShowsTheOtherSide) {
  // One strand to the right of the middle goes to the left when the head turns round.
  SceneAsset asset = curtain(1, 4);
  for (glm::vec3& point : asset.rest_position_m) point.x += 0.1f;
  LookDesc look;
  look.strand_radius_m = 0.01f;
  const auto renderer = make_renderer(asset, look);
  ASSERT_TRUE(renderer);
  PosedStrands strands{{}, asset.rest_position_m};
  const Image before = draw(*renderer, strands, front_camera());
  strands.world_from_head.rotation = glm::angleAxis(glm::pi<double>(), glm::dvec3(0, 1, 0));
  const Image after = draw(*renderer, strands, front_camera());
  const Image empty = draw_at_rest(empty_asset(), look);
  const auto differs = [&](const Image& image, uint32_t x) {
    return std::abs(luminance(image, x, 45) - luminance(empty, x, 45)) > 0.02;
  };
  EXPECT_TRUE(differs(before, 100) && !differs(before, 60));
  EXPECT_TRUE(differs(after, 60) && !differs(after, 100));
}

TEST_F(RendererTest, HairInFrontHidesHairBehindInAnyOrder) {
  // Two broad strands at the same place on the screen: swapping their order in the groom changes nothing.
  SceneAsset asset = curtain(2, 4);
  for (size_t i = 0; i < asset.rest_position_m.size(); ++i) {
    asset.rest_position_m[i].x = 0.0f;
    asset.rest_position_m[i].z = i % 2 == 0 ? 0.1f : -0.1f;
  }
  LookDesc look;
  look.strand_radius_m = 0.02f;
  const Image ordered = draw_at_rest(asset, look);
  for (size_t i = 0; i < asset.rest_position_m.size(); i += 2)
    std::swap(asset.rest_position_m[i], asset.rest_position_m[i + 1]);
  const Image swapped = draw_at_rest(asset, look);
  // Colours vary per strand, but by less than the light between front and back.
  EXPECT_LT(std::abs(luminance(ordered, 80, 45) - luminance(swapped, 80, 45)), 0.1);
}

TEST_F(RendererTest, CoincidentVerticesDrawNothingWrong) {
  SceneAsset asset = curtain(40, 6);
  for (glm::vec3& point : asset.rest_position_m) point = glm::vec3(0.0f, 0.0f, 0.02f);
  const Image image = draw_at_rest(asset);
  const Image empty = draw_at_rest(empty_asset());
  EXPECT_LE(differing_pixels(image, empty), 9u);
}

TEST_F(RendererTest, StrandsBehindTheCameraDrawNothing) {
  SceneAsset asset = curtain(40, 6);
  for (glm::vec3& point : asset.rest_position_m) point.z += 1.5f;
  EXPECT_EQ(differing_pixels(draw_at_rest(asset), draw_at_rest(empty_asset())), 0u);
}

TEST_F(RendererTest, TheProfileCountsWhatWasDrawn) {
  const SceneAsset asset = curtain(10, 6);
  LookDesc look;
  look.followers = 2;
  look.segments = 1;
  look.strand_radius_m = 0.005f;
  const auto renderer = make_renderer(asset, look);
  ASSERT_TRUE(renderer);
  draw(*renderer, {{}, asset.rest_position_m}, front_camera());
  EXPECT_EQ(renderer->profile().drawn_strands, 10u + 8u * 2u);
  EXPECT_EQ(renderer->profile().drawn_segments, 26u * 5u);
  EXPECT_GT(renderer->passes().last_ms("render/strands"), 0.0);
  EXPECT_EQ(renderer->passes().last_ms("render/head"), 0.0);
  EXPECT_GT(renderer->profile().total_ms, renderer->passes().last_ms("render/strands"));
}

/// 300 key strands and 1,788 followers of a uniform curtain, large enough that all of them are drawn.
constexpr RenderSize kLarge{1280, 720};
constexpr uint64_t kCurtainStrands = 300 + 298 * 6;
LookDesc curtain_look() {
  LookDesc look;
  look.followers = 6;
  look.strand_radius_m = 0.0002f;
  look.tip_scale = 1.0f;
  look.ambient = 0.0f;
  look.light_color = glm::vec3(0.0f);
  look.background = glm::vec3(0.3f);
  return look;
}

TEST_F(RendererTest, FewerAndWiderStrandsCoverAsMuchAsAllOfThem) {
  // Far away fewer are drawn; the mean of the picture stays.
  SceneAsset asset = curtain(300, 8);
  const auto renderer = make_renderer(asset, curtain_look());
  ASSERT_TRUE(renderer);
  const auto mean_luminance = [&](RenderSize size) {
    const Image image = draw(*renderer, {{}, asset.rest_position_m}, front_camera(), size);
    double sum = 0.0;
    for (uint32_t y = 0; y < size.height; ++y)
      for (uint32_t x = 0; x < size.width; ++x)
        sum += std::pow((luminance(image, x, y) + 0.055) / 1.055, 2.4);
    return sum / (size.width * size.height);
  };
  const double small = mean_luminance({160, 90});
  const uint64_t small_strands = renderer->profile().drawn_strands;
  const double large = mean_luminance({1280, 720});
  EXPECT_LT(small_strands, renderer->profile().drawn_strands);
  EXPECT_EQ(renderer->profile().drawn_strands, 300u + 298u * 6u);
  const double empty = 0.3;
  EXPECT_NEAR((empty - small) / (empty - large), 1.0, 0.06);
}

TEST_F(RendererTest, AShareOfTheStrandsCoversAsMuchAsAll) {
  const SceneAsset asset = curtain(300, 8);
  const auto renderer = make_renderer(asset, curtain_look());
  ASSERT_TRUE(renderer);
  const PosedStrands strands{{}, asset.rest_position_m};
  // What of the background is covered, in linear light; the strands are black.
  const auto covered = [&](float share) {
    const Status drawn = renderer->draw(strands, front_camera(), kLarge, {share, {}});
    EXPECT_TRUE(drawn) << drawn.error().to_string();
    const Image image = renderer->read_image();
    double sum = 0.0;
    for (uint32_t y = 0; y < kLarge.height; ++y)
      for (uint32_t x = 0; x < kLarge.width; ++x)
        sum += 0.3 - std::pow((luminance(image, x, y) + 0.055) / 1.055, 2.4);
    return sum;
  };
  const double whole = covered(1.0f);
  EXPECT_EQ(renderer->profile().drawn_strands, kCurtainStrands);
  // Of half of 2,088 strands: three followers of each triangle would be 1,194. Then the keys alone.
  for (const auto& [share, drawn] : {std::pair{0.5f, 300u + 298u * 2u}, {0.2f, 300u}}) {
    EXPECT_NEAR(covered(share) / whole, 1.0, 0.1) << share;
    EXPECT_EQ(renderer->profile().drawn_strands, drawn) << share;
  }
  // Then the first of the keys, which in this curtain stand side by side and not spread over it.
  covered(0.05f);
  EXPECT_EQ(renderer->profile().drawn_strands, 105u);
  EXPECT_FALSE(renderer->draw(strands, front_camera(), kSmall, {0.0f, {}}));
  EXPECT_FALSE(renderer->draw(strands, front_camera(), kSmall, {1.5f, {}}));
}

TEST_F(RendererTest, APictureThatNobodyWantsIsLeftBetweenTwoBatches) {
  const SceneAsset asset = curtain(300, 8);
  const auto renderer = make_renderer(asset, curtain_look());
  ASSERT_TRUE(renderer);
  const PosedStrands strands{{}, asset.rest_position_m};
  const Image whole = draw(*renderer, strands, front_camera(), kLarge);
  int asked = 0;
  const DrawTerms patient{1.0f, [&] { return ++asked < 0; }};
  ASSERT_TRUE(renderer->draw(strands, front_camera(), kLarge, patient));
  EXPECT_EQ(asked, 2) << "2,088 strands are three batches of 1,024 at most";
  EXPECT_TRUE(renderer->profile().is_whole);
  EXPECT_EQ(differing_pixels(renderer->read_image(), whole), 0u) << "batches change no pixel";
  ASSERT_TRUE(renderer->draw(strands, front_camera(), kLarge, {1.0f, [] { return true; }}));
  EXPECT_FALSE(renderer->profile().is_whole);
  EXPECT_EQ(renderer->profile().drawn_strands, 1024u);
}

TEST_F(RendererTest, WrongSizesAreErrorsInWords) {
  const SceneAsset asset = curtain(10, 6);
  const auto renderer = make_renderer(asset);
  ASSERT_TRUE(renderer);
  PosedStrands strands{{}, asset.rest_position_m};
  strands.position_m.pop_back();
  const Status too_few = renderer->draw(strands, front_camera(), kSmall);
  ASSERT_FALSE(too_few);
  EXPECT_NE(too_few.error().message.find("59"), std::string::npos);
  strands.position_m = asset.rest_position_m;
  EXPECT_FALSE(renderer->draw(strands, front_camera(), {0, 90}));
  EXPECT_FALSE(renderer->draw(strands, front_camera(), {9000, 90}));

  SceneAsset bad = asset;
  bad.triangle.emplace_back(0, 1, 10);
  EXPECT_FALSE(Renderer::make(gl::ShaderLibrary(), context_->info(), bad, {}));
  bad = asset;
  bad.head = octahedron(0.1f);
  bad.head.triangle.emplace_back(0, 1, 6);
  EXPECT_FALSE(Renderer::make(gl::ShaderLibrary(), context_->info(), bad, {}));
}

}  // namespace
}  // namespace strandcast::renderer_test

#include "common/render/debug_view.h"

#include <cmath>

#include "tests/support/grown_hair.h"
#include "tests/support/sample_look.h"

namespace strandcast::debug_view_test {
namespace {

/// One thick strand that hangs in front of the head's middle, alone.
SceneAsset one_strand(const glm::vec3& along) {
  SceneAsset asset;
  asset.strand_count = 1;
  asset.vertex_count = 3;
  for (int i = 0; i < 3; ++i) asset.rest_position_m.push_back(0.05f * static_cast<float>(i) * along);
  return asset;
}

LookDesc thick() {
  LookDesc look;
  look.strand_radius_m = 0.02f;
  look.tip_scale = 1.0f;
  look.style = {};
  look.style.tip_fade = 0.0f;
  look.style.frizz_m = look.style.wave_m = 0.0f;
  return look;
}

const uint8_t* pixel(const Image& image, uint32_t x, uint32_t y) {
  return image.rgba.data() + (size_t{y} * image.width + x) * 4;
}

TEST(DebugView, NamesComeBack) {
  DebugView view = DebugView::None;
  for (const DebugView each : kDebugViews) {
    EXPECT_EQ(view, each);
    EXPECT_EQ(debug_view_named(name_of(each)), each);
    view = next_of(view);
  }
  EXPECT_EQ(view, DebugView::None);
  EXPECT_EQ(debug_view_named("nothing of the kind"), DebugView::None);
}

TEST(DebugView, EachIsAPictureOfItsOwnAndLeavesNothingBehind) {
  const SceneAsset asset = grown_hair();
  auto renderer = make_tile_renderer(asset, sample_look(), {own_workers(2), simd::widest_set()});
  ASSERT_TRUE(renderer);
  const auto picture = [&](DebugView view) {
    EXPECT_TRUE((*renderer)->draw({{}, asset.rest_position_m}, {}, {160, 120}, {1.0f, {}, view}));
    return (*renderer)->read_image();
  };
  std::vector<Image> all;
  for (const DebugView view : kDebugViews) all.push_back(picture(view));
  for (size_t i = 0; i < all.size(); ++i)
    for (size_t j = 0; j < i; ++j) EXPECT_FALSE(all[i] == all[j]) << i << ", " << j;
  EXPECT_TRUE(picture(DebugView::None) == all[0]);
  // Whatever runs them.
  for (const DebugView view : kDebugViews)
    EXPECT_TRUE(drawn(asset, {}, {own_workers(1), simd::InstructionSet::Plain}, {96, 64}, {}, view) ==
                drawn(asset, {}, {own_workers(3), simd::widest_set()}, {96, 64}, {}, view))
        << name_of(view);
}

TEST(DebugView, TangentsAreColours) {
  CameraDesc camera;
  camera.target_m = {0.0f, -0.04f, 0.0f};
  camera.offset_m = {0.0f, 0.0f, 0.5f};
  auto renderer = make_tile_renderer(one_strand({0.0f, -1.0f, 0.0f}), thick());
  ASSERT_TRUE(renderer);
  const std::vector<glm::vec3> down = one_strand({0.0f, -1.0f, 0.0f}).rest_position_m;
  ASSERT_TRUE((*renderer)->draw({{}, down}, camera, {64, 64}, {1.0f, {}, DebugView::Tangents}));
  const Image image = (*renderer)->read_image();
  const uint8_t* const middle = pixel(image, 32, 32);
  // Down: x and z have none, 0.5 of light is 188 in sRGB; y is -1, no light.
  EXPECT_NEAR(middle[0], 188, 2);
  EXPECT_NEAR(middle[1], 0, 2);
  EXPECT_NEAR(middle[2], 188, 2);
}

TEST(DebugView, OverdrawCountsLayers) {
  CameraDesc camera;
  camera.target_m = {0.0f, -0.04f, 0.0f};
  camera.offset_m = {0.0f, 0.0f, 0.5f};
  SceneAsset asset = one_strand({0.0f, -1.0f, 0.0f});
  const auto light_of = [&] {
    const Image image =
        drawn(asset, thick(), {own_workers(1), simd::widest_set()}, {64, 64}, camera, DebugView::Overdraw);
    EXPECT_EQ(pixel(image, 2, 32)[0], 0) << "nothing beside the strand";
    const double srgb = pixel(image, 32, 32)[0] / 255.0;
    return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
  };
  const double layer = 1.0 / kOverdrawLayers;
  EXPECT_NEAR(light_of(), kDebugWhite * layer, 0.002);
  // The same strand three times.
  const std::vector<glm::vec3> one = asset.rest_position_m;
  asset.strand_count = 3;
  asset.rest_position_m.clear();
  for (const glm::vec3& vertex : one)
    for (int strand = 0; strand < 3; ++strand) asset.rest_position_m.push_back(vertex);
  EXPECT_NEAR(light_of(), kDebugWhite * (1.0 - std::pow(1.0 - layer, 3)), 0.003);
}

TEST(DebugView, TilesHaveBorders) {
  const Image image =
      drawn(grown_hair(), {}, {own_workers(1), simd::widest_set()}, {160, 120}, {}, DebugView::Tiles);
  for (const uint32_t x : {0u, 32u, 64u})
    for (int c = 0; c < 3; ++c) EXPECT_EQ(pixel(image, x, 50)[c], 0);
  EXPECT_GT(pixel(image, 5, 5)[0], 0);
}

}  // namespace
}  // namespace strandcast::debug_view_test

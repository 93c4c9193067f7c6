// Drawn strands as numbers: those of a picture, with their taper and colour.
#include "common/render/drawn_strands.h"

#include <gtest/gtest.h>

#include "common/groom/groom_asset.h"
#include "common/groom/procedural.h"
#include "common/render/tiles/tile_renderer.h"
#include "common/scene/hair_color.h"

namespace strandcast::drawn_strands_test {
namespace {

SceneAsset small_hair() {
  ProceduralGroomOptions options;
  options.strand_count = 300;
  return make_scene_asset(grow_groom(make_scalp_cap(glm::vec3(0.0f), 0.095f, 400), options).value(), {});
}

LookDesc even_look() {
  LookDesc look;
  look.hair_color = "brown";
  look.style.length_spread = 0.0f;
  look.shading.strand_variation = look.shading.lock_variation = look.shading.warmth_variation = 0.0f;
  return look;
}

TEST(DrawnHair, HasTheStrandsOfTheFinestPicture) {
  const SceneAsset asset = small_hair();
  LookDesc look;
  for (const uint32_t followers : {0u, 3u}) {
    look.followers = followers;
    DrawnHair hair = DrawnHair::make(asset, look).value();
    TileOptions finest;
    finest.is_finest = true;
    const auto renderer = make_tile_renderer(asset, look, finest).value();
    ASSERT_TRUE(renderer->draw({{}, asset.rest_position_m}, {}, {64, 64}));
    EXPECT_EQ(hair.strand_count(), renderer->profile().drawn_strands);
    EXPECT_EQ(hair.strands(asset.rest_position_m).strand_count(), hair.strand_count());
  }
}

TEST(DrawnHair, KeysBeginAtTheirRootsAndGetThinner) {
  const SceneAsset asset = small_hair();
  const LookDesc look = even_look();
  const DrawnStrands drawn = DrawnHair::make(asset, look)->strands(asset.rest_position_m);
  ASSERT_EQ(drawn.first_point.back(), drawn.position_m.size());
  for (uint32_t s = 0; s < asset.strand_count; ++s) {
    const uint32_t first = drawn.first_point[s];
    const uint32_t last = drawn.first_point[s + 1] - 1;
    EXPECT_LT(glm::distance(drawn.position_m[first], asset.rest_position_m[s]), 1e-4f) << s;
    const uint32_t middle = (first + last) / 2;
    // Past what comes out of the skin the width falls with the square of the way.
    const float along = static_cast<float>(middle - first) / static_cast<float>(last - first);
    EXPECT_NEAR(drawn.width_m[middle],
                2.0f * look.strand_radius_m * (1.0f + (look.tip_scale - 1.0f) * along * along), 1e-8f);
    EXPECT_LT(drawn.width_m[last], drawn.width_m[middle]);
  }
}

TEST(DrawnHair, ColoursAreThoseOfTheLookWithoutDarkRoots) {
  const SceneAsset asset = small_hair();
  LookDesc look = even_look();
  look.shading.root_darkening = 1.0f;
  const HairColors colors = colors_of(look);
  const DrawnStrands drawn = DrawnHair::make(asset, look)->strands(asset.rest_position_m);
  for (uint32_t s = 0; s < drawn.strand_count(); ++s) {
    EXPECT_LT(glm::distance(drawn.color[drawn.first_point[s]], colors.root), 1e-6f);
    EXPECT_LT(glm::distance(drawn.color[drawn.first_point[s + 1] - 1], colors.tip), 1e-6f);
  }
  // The counter-example: with its variation no two strands need have one colour.
  look.shading.strand_variation = 0.2f;
  const DrawnStrands varied = DrawnHair::make(asset, look)->strands(asset.rest_position_m);
  EXPECT_NE(varied.color[varied.first_point[0]], varied.color[varied.first_point[1]]);
}

}  // namespace
}  // namespace strandcast::drawn_strands_test

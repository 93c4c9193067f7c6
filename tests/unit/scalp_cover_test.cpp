#include "common/render/scalp_cover.h"

#include <algorithm>
#include <cmath>

namespace strandcast::scalp_cover_test {
namespace {

// Roots on the upper half of a sphere of 0.1 m; head vertices at its top, at its bottom, and far away.
SceneAsset half_sphere(uint32_t strand_count) {
  SceneAsset asset;
  asset.strand_count = strand_count;
  asset.vertex_count = 1;
  for (uint32_t i = 0; i < strand_count; ++i) {
    const float height = (static_cast<float>(i) + 0.5f) / static_cast<float>(strand_count);
    const float turn = 2.39996f * static_cast<float>(i);
    const float ring = std::sqrt(1.0f - height * height);
    asset.rest_position_m.emplace_back(0.1f *
                                       glm::vec3(ring * std::cos(turn), height, ring * std::sin(turn)));
  }
  asset.head.position_m = {{0, 0.1f, 0}, {0.0866f, 0.05f, 0}, {0, -0.1f, 0}, {5, 5, 5}};
  return asset;
}

TEST(ScalpCover, IsFullUnderHairAndZeroElsewhere) {
  EXPECT_EQ(scalp_cover(half_sphere(1000), 0.02f), (std::vector<float>{1.0f, 1.0f, 0.0f, 0.0f}));
}

TEST(ScalpCover, DoesNotDependOnHowManyStrandsThereAre) {
  EXPECT_EQ(scalp_cover(half_sphere(4000), 0.02f), scalp_cover(half_sphere(1000), 0.02f));
}

TEST(ScalpCover, ABaldHeadIsBare) {
  SceneAsset asset = half_sphere(1);
  asset.strand_count = 0;
  asset.rest_position_m.clear();
  EXPECT_EQ(scalp_cover(asset, 0.02f), std::vector<float>(4, 0.0f));
  EXPECT_EQ(scalp_cover(half_sphere(1000), 0.0f), std::vector<float>(4, 0.0f));
}

TEST(ScalpCover, AllRootsInOnePointStayCheapAndFinite) {
  SceneAsset asset = half_sphere(20'000);
  std::fill(asset.rest_position_m.begin(), asset.rest_position_m.end(), glm::vec3(0.0f, 0.1f, 0.0f));
  asset.head.position_m.assign(20'000, glm::vec3(0.001f, 0.1f, 0.0f));
  for (const float cover : scalp_cover(asset, 0.02f)) ASSERT_EQ(cover, 1.0f);
}

}  // namespace
}  // namespace strandcast::scalp_cover_test

#include "common/render/scalp_cover.h"

#include <algorithm>
#include <cmath>

#include "common/groom/groom_asset.h"
#include "common/groom/procedural.h"

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

/// Few roots, spread over a cap, with the triangles between them; the head is the sphere below.
SceneAsset sparse_cap(uint32_t strand_count) {
  const Mesh cap = make_scalp_cap(glm::vec3(0.0f), 0.095f, 2000);
  ProceduralGroomOptions options;
  options.strand_count = strand_count;
  const auto groom = grow_groom(cap, options);
  EXPECT_TRUE(groom) << groom.error().to_string();
  return groom ? make_scene_asset(*groom, make_head(0.095f)) : SceneAsset{};
}

/// Mean and deviation of the tint where the head is well inside of the roots' hull, and the most far outside.
struct Tint {
  double mean = 0.0, deviation = 0.0;
  float most_outside = 0.0f;
  uint32_t inside = 0;
};

Tint tint_of(const SceneAsset& asset, const std::vector<float>& cover) {
  Tint tint;
  double sum = 0.0, squares = 0.0;
  for (size_t i = 0; i < cover.size(); ++i) {
    const glm::vec3 at = asset.head.position_m[i] / 0.095f;
    // The cap reaches down to the ears at the sides and to the forehead; the face is outside.
    if (at.y > 0.75f && std::abs(at.z) < 0.4f) {
      ++tint.inside;
      sum += cover[i];
      squares += double{cover[i]} * cover[i];
    }
    if (at.z > 0.6f && at.y < -0.1f) tint.most_outside = std::max(tint.most_outside, cover[i]);
  }
  tint.mean = sum / tint.inside;
  tint.deviation = std::sqrt(std::max(0.0, squares / tint.inside - tint.mean * tint.mean));
  return tint;
}

TEST(ScalpCover, IsEvenBetweenSparseRootsAndNothingBesideThem) {
  constexpr float kReachM = 0.0075f;
  for (const uint32_t strand_count : {60u, 100u, 500u, 2000u}) {
    const SceneAsset asset = sparse_cap(strand_count);
    const Tint tint = tint_of(asset, scalp_cover(asset, kReachM));
    EXPECT_GT(tint.inside, 30u);
    EXPECT_GT(tint.mean, 0.99) << strand_count;
    EXPECT_LT(tint.deviation, 0.05) << strand_count;
    EXPECT_EQ(tint.most_outside, 0.0f) << strand_count;
    // The counter-example: by the distance to the nearest root each has a disc of its own.
    if (strand_count > 100) continue;
    std::vector<float> discs;
    for (const glm::vec3& at_m : asset.head.position_m) {
      float nearest_m = kReachM;
      for (uint32_t i = 0; i < strand_count; ++i)
        nearest_m = std::min(nearest_m, glm::distance(at_m, asset.rest_position_m[i]));
      discs.push_back(1.0f - nearest_m / kReachM);
    }
    EXPECT_GT(tint_of(asset, discs).deviation, 0.1) << strand_count;
  }
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

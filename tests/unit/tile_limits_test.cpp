// Memory of the tile renderer stays within its limits, and what is left out for that is counted and said.
#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "common/render/strand_detail.h"
#include "common/render/tiles/tile_bins.h"
#include "tests/support/grown_hair.h"

namespace strandcast::tile_limits_test {
namespace {

using testing::HasSubstr;

/// Level lines on the border of two rows of tiles, from one side of the picture to the other.
StrandPoints level_lines(uint32_t count, float width_px) {
  StrandPoints points;
  points.first_point.push_back(0);
  constexpr uint16_t kHalfOfOne = 0x3c00;
  for (uint32_t i = 0; i < count; ++i) {
    for (const float x : {1.0f, width_px - 1.0f}) {
      StrandPoint point{x, static_cast<float>(kTilePx), 1.0f, 0, {}};
      point.half[kWidthPx] = kHalfOfOne;
      points.point.push_back(point);
    }
    points.first_point.push_back(static_cast<uint32_t>(points.point.size()));
    points.index.push_back(i);
    points.lock.push_back(i);
  }
  return points;
}

TEST(TileLimits, PairsThatDoNotFitLeaveStrandsOutEvenly) {
  const TileGrid grid{{kMaxImageSide, 2 * kTilePx}};
  const uint32_t pairs_each = 2 * grid.columns();
  const auto fitting = static_cast<uint32_t>(kMaxTilePairs / pairs_each);
  WorkerPool workers(2);
  for (const uint32_t strands : {fitting, fitting + fitting / 2}) {
    const StrandPoints points = level_lines(strands, static_cast<float>(kMaxImageSide));
    TileBins bins;
    const BinCounts counts = bins.bin_segments(points, grid, 0.01f, workers);
    EXPECT_LE(bins.segments().item.size(), kMaxTilePairs);
    EXPECT_EQ(bins.segments().item.size(),
              size_t{strands - static_cast<uint32_t>(counts.left_out)} * pairs_each);
    EXPECT_EQ(counts.left_out > 0, strands > fitting) << strands;
    EXPECT_EQ(counts.segments, strands - counts.left_out);
    // Each half of the strands loses as many, within one.
    uint32_t first_half = 0;
    for (uint32_t i = bins.segments().first[0]; i < bins.segments().first[1]; ++i)
      first_half += bins.segments().item[i].point / 2 < strands / 2;
    EXPECT_NEAR(first_half, 0.5 * static_cast<double>(counts.segments), 1.5) << strands;
    // Room that is there is used: at least three quarters of it.
    if (counts.left_out > 0) {
      EXPECT_GT(bins.segments().item.size(), kMaxTilePairs / 4 * 3);
    }
  }
}

TEST(TileLimits, FewerStrandsAreDrawnWhereTheirPointsDoNotFit) {
  DetailFacts facts;
  facts.key_count = 100'000;
  facts.vertex_count = 64;
  facts.mean_length_m = 0.3f;
  facts.max_points = 1'000'000;
  LookDesc look;
  const auto view = make_view({}, glm::dquat(1.0, 0.0, 0.0, 0.0), {640, 360});
  ASSERT_TRUE(view);
  const StrandDetail detail = choose_detail(facts, look, *view, {});
  EXPECT_LE(uint64_t{detail.strand_count} * points_per_strand(facts, detail), facts.max_points);
  EXPECT_GT(detail.strand_count, 0u);
  facts.max_points = std::numeric_limits<uint64_t>::max() / 2;
  EXPECT_EQ(choose_detail(facts, look, *view, {}).strand_count, 100'000u);
}

TEST(TileLimits, WhatIsLeftOutIsSaid) {
  SceneAsset asset = grown_hair(40);
  asset.rest_position_m[45] = glm::vec3(std::numeric_limits<float>::quiet_NaN());
  auto renderer = make_tile_renderer(asset, {});
  ASSERT_TRUE(renderer);
  ASSERT_TRUE((*renderer)->draw({{}, asset.rest_position_m}, {}, {96, 64}));
  EXPECT_GT((*renderer)->profile().unusable_segments, 0u);
  EXPECT_THAT(left_out_text((*renderer)->profile()), HasSubstr("segments without usable positions"));
  const SceneAsset sound = grown_hair(40);
  ASSERT_TRUE((*renderer)->draw({{}, sound.rest_position_m}, {}, {96, 64}));
  EXPECT_EQ((*renderer)->profile().unusable_segments, 0u);
  EXPECT_EQ(left_out_text((*renderer)->profile()), "");
  RenderProfile profile;
  profile.left_out_strands = 3;
  profile.unusable_segments = 5;
  EXPECT_EQ(left_out_text(profile), "3 strands for lack of memory, 5 segments without usable positions");
}

TEST(TileLimits, AHundredThousandStrandsAreDrawn) {
  // Straight out of a ball, on a spiral round it.
  SceneAsset asset;
  asset.strand_count = 100'000;
  asset.vertex_count = 3;
  for (uint32_t vertex = 0; vertex < asset.vertex_count; ++vertex)
    for (uint32_t strand = 0; strand < asset.strand_count; ++strand) {
      const float part = (static_cast<float>(strand) + 0.5f) / static_cast<float>(asset.strand_count);
      const float y = 1.0f - 2.0f * part;
      const float angle = 2.4f * static_cast<float>(strand);
      const float level = std::sqrt(1.0f - y * y);
      const float away_m = kHeadRadiusM + 0.05f * static_cast<float>(vertex);
      asset.rest_position_m.push_back(away_m *
                                      glm::vec3(level * std::cos(angle), y, level * std::sin(angle)));
    }
  LookDesc look;
  look.followers = 0;
  auto renderer = make_tile_renderer(asset, look, {own_workers(2), simd::widest_set()});
  ASSERT_TRUE(renderer);
  ASSERT_TRUE((*renderer)->draw({{}, asset.rest_position_m}, {}, {64, 64}));
  EXPECT_EQ((*renderer)->profile().drawn_strands, 100'000u);
  EXPECT_EQ(left_out_text((*renderer)->profile()), "");
}

TEST(TileLimits, TheLongestSidesAreDrawn) {
  const SceneAsset asset = grown_hair(20);
  for (const RenderSize size : {RenderSize{kMaxImageSide, 8}, RenderSize{8, kMaxImageSide}}) {
    const Image image = drawn(asset, {}, {own_workers(2), simd::widest_set()}, size);
    EXPECT_EQ(image.rgba.size(), size_t{size.width} * size.height * 4);
    EXPECT_GT(image.rgba[0], 0);
  }
  auto renderer = make_tile_renderer(asset, {});
  ASSERT_TRUE(renderer);
  EXPECT_FALSE((*renderer)->draw({{}, asset.rest_position_m}, {}, {kMaxImageSide + 1, 8}));
}

TEST(TileLimits, AnEyeInTheHairAndOneWhoseDepthHasNoLengthGiveAPicture) {
  const SceneAsset asset = grown_hair(100);
  for (const glm::vec3& offset :
       {glm::vec3(0.0f, 0.0f, 1e-6f), glm::vec3(0.0f, 1e-3f, 0.0f), glm::vec3(0.0f, 0.0f, 100.0f)}) {
    CameraDesc camera;
    camera.target_m = {0.0f, 0.1f, 0.0f};  // on the scalp
    camera.offset_m = offset;
    const Image image = drawn(asset, {}, {own_workers(2), simd::widest_set()}, {64, 48}, camera);
    ASSERT_EQ(image.rgba.size(), 64u * 48u * 4u);
    for (size_t i = 3; i < image.rgba.size(); i += 4) ASSERT_EQ(image.rgba[i], 255);
  }
}

}  // namespace
}  // namespace strandcast::tile_limits_test

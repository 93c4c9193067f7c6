#include "common/strands/scene_asset.h"
#include "common/groom/groom_asset.h"

#include <limits>

#include "tests/support/sample_asset.h"

namespace strandcast::scene_asset_test {
namespace {

void expect_same(const SceneAsset& a, const SceneAsset& b) {
  EXPECT_EQ(a.strand_count, b.strand_count);
  EXPECT_EQ(a.vertex_count, b.vertex_count);
  EXPECT_EQ(a.rest_position_m, b.rest_position_m);
  EXPECT_EQ(a.triangle, b.triangle);
  EXPECT_EQ(a.head.position_m, b.head.position_m);
  EXPECT_EQ(a.head.normal, b.head.normal);
  EXPECT_EQ(a.head.triangle, b.head.triangle);
}

TEST(SceneAsset, ComesBackBitExactly) {
  for (const auto& [strands, vertices] : {std::pair{1u, 2u}, {3u, 64u}, {500u, 16u}}) {
    SceneAsset asset = sample_asset(strands, vertices);
    const auto decoded = decode_scene_asset(encode_scene_asset(asset));
    ASSERT_TRUE(decoded) << decoded.error().to_string();
    expect_same(*decoded, asset);
    asset.head = {};
    asset.triangle.clear();
    const auto bare = decode_scene_asset(encode_scene_asset(asset));
    ASSERT_TRUE(bare) << bare.error().to_string();
    expect_same(*bare, asset);
  }
}

TEST(SceneAsset, TakesTheGroomVertexMajor) {
  const Groom groom = random_groom(40, 5, 3);
  const SceneAsset asset = make_scene_asset(groom, sample_mesh());
  EXPECT_EQ(asset.strand_count, 40u);
  EXPECT_EQ(asset.vertex_count, 5u);
  for (uint32_t s = 0; s < 40; ++s)
    for (uint32_t v = 0; v < 5; ++v)
      EXPECT_EQ(asset.rest_position_m[v * 40 + s], groom.rest_position_m[groom.offset[s] + v]);
  EXPECT_LE(asset.triangle.size(), size_t{40} * kMaxTrianglesPerStrand);
  const auto decoded = decode_scene_asset(encode_scene_asset(asset));
  ASSERT_TRUE(decoded) << decoded.error().to_string();
  expect_same(*decoded, asset);
}

TEST(SceneAsset, EveryIndexAndNumberIsChecked) {
  const SceneAsset good = sample_asset(10, 4);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<std::pair<std::string, std::function<void(SceneAsset&)>>> changes = {
      {"rest position 7", [&](SceneAsset& a) { a.rest_position_m[7].y = nan; }},
      {"rest position 39", [](SceneAsset& a) { a.rest_position_m[39].x = 2.0f * kMaxGroomExtentM; }},
      {"root triangle 2", [](SceneAsset& a) { a.triangle[2].z = 10; }},
      {"root triangle 0", [](SceneAsset& a) { a.triangle[0].x = ~0u; }},
      {"mesh vertex 3", [](SceneAsset& a) { a.head.position_m[3].z = INFINITY; }},
      {"mesh normal 1", [](SceneAsset& a) { a.head.normal[1].x = 2.0f; }},
      {"mesh triangle 2", [](SceneAsset& a) { a.head.triangle[2].y = 4; }},
  };
  for (const auto& [what, change] : changes) {
    SceneAsset bad = good;
    change(bad);
    const auto refused = decode_scene_asset(encode_scene_asset(bad));
    ASSERT_FALSE(refused) << what;
    EXPECT_EQ(refused.error().code, ErrorCode::BadInput);
    EXPECT_THAT(refused.error().message, testing::HasSubstr(what));
  }
}

TEST(SceneAsset, CountsAreCheckedBeforeAnythingElse) {
  const auto good = encode_scene_asset(sample_asset(10, 4));
  const auto with_number = [&](size_t index, uint32_t value) {
    auto bytes = good;
    std::memcpy(bytes.data() + 4 * index, &value, 4);
    return decode_scene_asset(bytes);
  };
  EXPECT_EQ(with_number(0, 2).error().code, ErrorCode::BadInput);  // layout
  for (const uint32_t strands : {0u, kMaxStrandCount + 1, ~0u})
    EXPECT_EQ(with_number(1, strands).error().code, ErrorCode::LimitExceeded) << strands;
  for (const uint32_t vertices : {0u, 1u, kMaxVertexCount + 1, ~0u})
    EXPECT_EQ(with_number(2, vertices).error().code, ErrorCode::LimitExceeded) << vertices;
  EXPECT_EQ(with_number(3, 10 * kMaxTrianglesPerStrand + 1).error().code, ErrorCode::LimitExceeded);
  EXPECT_EQ(with_number(4, kMaxMeshVertices + 1).error().code, ErrorCode::LimitExceeded);
  EXPECT_EQ(with_number(5, kMaxMeshTriangles + 1).error().code, ErrorCode::LimitExceeded);
  // Within the limits, but not what the compressed part declares.
  EXPECT_EQ(with_number(1, 11).error().code, ErrorCode::BadInput);
  EXPECT_EQ(with_number(1, 9).error().code, ErrorCode::LimitExceeded);
}

}  // namespace
}  // namespace strandcast::scene_asset_test

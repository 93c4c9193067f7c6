#include "common/strands/scene_asset.h"
#include "common/groom/groom_asset.h"

#include <limits>

#include "common/groom/head_shape.h"
#include "common/groom/procedural.h"
#include "common/scene/scene_file.h"
#include "common/strands/asset/head.h"
#include "common/strands/asset/lattice.h"
#include "common/strands/asset/layout.h"
#include "common/strands/head/head_form.h"
#include "server/scene/scene_content.h"
#include "tests/support/claims.h"
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

AssetLayout layout_of(std::span<const std::byte> payload) {
  AssetLayout layout{};
  std::memcpy(&layout, payload.data(), sizeof layout);
  return layout;
}

/// Expects the asset to come back from its payload of this layout.
void expect_back(const SceneAsset& asset, AssetLayout layout) {
  const auto payload = encode_scene_asset(asset, layout);
  EXPECT_EQ(layout_of(payload), layout);
  const auto decoded = decode_scene_asset(payload);
  ASSERT_TRUE(decoded) << decoded.error().to_string();
  expect_same(*decoded, asset);
}

/// Strands with turns of their own, of segments that are all alike or not.
SceneAsset curly_asset(uint32_t strands, uint32_t vertices, float stretch) {
  SceneAsset asset = sample_asset(strands, vertices);
  for (uint32_t s = 0; s < strands; ++s)
    for (uint32_t v = 1; v < vertices; ++v) {
      const auto along = static_cast<float>(v), turn = 0.7f * along + static_cast<float>(s);
      const glm::vec3 way{0.005f * std::cos(turn), -0.01f - stretch * along, 0.005f * std::sin(turn)};
      asset.rest_position_m[v * strands + s] = asset.rest_position_m[(v - 1) * strands + s] + way;
    }
  round_to_lattice(asset.rest_position_m, kRestStepBits);
  return asset;
}

TEST(SceneAsset, ComesBackBitExactlyInEveryLayout) {
  for (const auto& [strands, vertices] : {std::pair{1u, 2u}, {2u, 3u}, {3u, 64u}, {500u, 16u}}) {
    SceneAsset asset = sample_asset(strands, vertices);
    expect_back(asset, AssetLayout::Floats);
    round_to_lattice(asset.rest_position_m, kRestStepBits);
    for (const AssetLayout layout : {AssetLayout::Floats, AssetLayout::Numbers}) {
      expect_back(asset, layout);
      expect_back(curly_asset(strands, vertices, 0.0f), layout);
      expect_back(curly_asset(strands, vertices, 0.001f), layout);
      SceneAsset bare = asset;
      bare.head = {};
      bare.triangle.clear();
      expect_back(bare, layout);
    }
  }
}

TEST(SceneAsset, WhatIsOnNoLatticeIsSentAsFloats) {
  const SceneAsset good = sample_asset(10, 4);
  ASSERT_EQ(layout_of(encode_scene_asset(good)), AssetLayout::Numbers);
  const std::vector<std::function<void(SceneAsset&)>> changes = {
      [](SceneAsset& a) { a.rest_position_m[3].x = 1e-20f; },
      [](SceneAsset& a) { a.rest_position_m[3].x = 99.0f, a.rest_position_m[4].x = 0x1p-24f; },
      [](SceneAsset& a) { a.head.normal[1] = glm::normalize(glm::vec3(1.0f, 2.0f, 3.0f)); },
      [](SceneAsset& a) { std::swap(a.head.triangle[0], a.head.triangle[2]); },
      [](SceneAsset& a) { a.head.triangle.clear(); }};
  for (size_t i = 0; i < changes.size(); ++i) {
    SceneAsset other = good;
    changes[i](other);
    EXPECT_EQ(layout_of(encode_scene_asset(other)), AssetLayout::Floats) << i;
    const auto decoded = decode_scene_asset(encode_scene_asset(other));
    ASSERT_TRUE(decoded) << decoded.error().to_string();
    expect_same(*decoded, other);
  }
  SceneAsset zero = good;
  zero.rest_position_m[3].x = -0.0f;
  EXPECT_TRUE(std::signbit(decode_scene_asset(encode_scene_asset(zero)).value().rest_position_m[3].x));
}

TEST(SceneAsset, TheBuiltInHairTakesFewBytes) {
  const SceneDesc scene = built_in_scene_with({}).value();
  const SceneContent content = load_scene_content(scene).value();
  const SceneAsset asset = make_scene_asset(content.groom, content.head);
  ASSERT_EQ(asset.strand_count, 2'000u);
  ASSERT_EQ(asset.vertex_count, 16u);
  ASSERT_FALSE(asset.head.triangle.empty());
  EXPECT_EQ(as_sent(content.head).position_m, content.head.position_m) << "what is rounded stays";
  expect_back(asset, AssetLayout::Numbers);
  expect_back(asset, AssetLayout::Form);
  EXPECT_LE(encode_scene_asset(asset).size(), claims::kAssetKb * 1000);
  EXPECT_GT(encode_scene_asset(asset, AssetLayout::Numbers).size(), claims::kAssetKb * 1000 + 40'000)
      << "the head by its form";
  EXPECT_GT(encode_scene_asset(asset, AssetLayout::Floats).size(), 3 * claims::kAssetKb * 1000)
      << "without it";
}

/// Triangles by the places of their corners, each turned so that the least comes first, sorted.
std::vector<std::array<glm::vec3, 3>> places_of(const Mesh& mesh) {
  using Places = std::array<glm::vec3, 3>;
  const auto is_less = [](const Places& a, const Places& b) {
    return std::memcmp(a.data(), b.data(), sizeof a) < 0;  // any order will do
  };
  std::vector<Places> places;
  for (const glm::uvec3& triangle : mesh.triangle) {
    const glm::vec3 a = mesh.position_m[triangle.x], b = mesh.position_m[triangle.y],
                    c = mesh.position_m[triangle.z];
    places.push_back(std::min({Places{a, b, c}, Places{b, c, a}, Places{c, a, b}}, is_less));
  }
  std::sort(places.begin(), places.end(), is_less);
  return places;
}

TEST(SceneAsset, AnyMeshKeepsItsTrianglesInTheOrderInWhichItIsSent) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> place(-0.2f, 0.2f);
  for (const uint32_t vertices : {3u, 6u, 40u, 300u})
    for (const uint32_t triangles : {1u, 5u, 60u, 700u}) {
      // Soups: edges of many triangles, holes, pieces apart, vertices of no triangle, corners that coincide.
      Mesh soup;
      for (uint32_t i = 0; i < vertices; ++i) {
        soup.position_m.emplace_back(place(random), place(random), place(random));
        soup.normal.push_back(glm::normalize(glm::vec3(place(random), place(random), place(random) + 1e-3f)));
      }
      for (uint32_t i = 0; i < triangles; ++i)
        soup.triangle.emplace_back(random() % vertices, random() % vertices, random() % vertices);
      const Mesh sent = as_sent(soup);
      ASSERT_EQ(sent.position_m.size(), soup.position_m.size());
      Mesh rounded = soup;
      round_to_lattice(rounded.position_m, kHeadStepBits);
      EXPECT_TRUE(places_of(sent) == places_of(rounded)) << vertices << " " << triangles;
      EXPECT_TRUE(as_sent(sent).triangle == sent.triangle) << vertices << " " << triangles;
      SceneAsset asset = sample_asset(10, 4);
      asset.head = sent;
      expect_back(asset, AssetLayout::Numbers);
    }
}

TEST(SceneAsset, NormalsAreThoseOfTheHead) {
  Mesh head = make_head(0.1f);
  const Mesh sent = as_sent(head);
  // The normals of both are those of their places: half a step of the octahedron is 1/1024 at most.
  const auto at = places_of(sent);
  round_to_lattice(head.position_m, kHeadStepBits);
  EXPECT_TRUE(at == places_of(head));
  std::map<std::tuple<float, float, float>, glm::vec3> normal;
  for (size_t i = 0; i < head.position_m.size(); ++i)
    normal[{head.position_m[i].x, head.position_m[i].y, head.position_m[i].z}] = head.normal[i];
  for (size_t i = 0; i < sent.position_m.size(); ++i) {
    const glm::vec3& p = sent.position_m[i];
    EXPECT_LT(glm::length(sent.normal[i] - normal.at({p.x, p.y, p.z})), 2e-3f) << i;
  }
}

/// An asset whose head is fitted under hair: all of it, or the bust alone.
SceneAsset asset_with_head(HeadFit fit) {
  ProceduralGroomOptions options;
  options.strand_count = 300;
  options.vertex_count = 12;
  options.length_m = 0.4f;
  const Groom groom = grow_groom(make_scalp_cap({0.01f, 0.02f, 0.0f}, 0.1f, 500), options).value();
  SceneAsset asset = sample_asset(40, 12);
  round_to_lattice(asset.rest_position_m, kRestStepBits);
  asset.head = as_sent(HeadShape(groom, {{0.01f, 0.02f, 0.0f}, 0.093f}, fit).mesh());
  return asset;
}

TEST(SceneAsset, AFittedHeadIsToldByItsForm) {
  for (const HeadFit fit : {HeadFit::Whole, HeadFit::BustOnly}) {
    const SceneAsset asset = asset_with_head(fit);
    ASSERT_NE(asset.head.form, nullptr);
    EXPECT_NE(asset.head.form->neck_width, HeadForm().neck_width);
    expect_back(asset, AssetLayout::Form);
    SceneAsset bare = asset;
    bare.head = {};
    const size_t bytes = encode_scene_asset(asset).size() - encode_scene_asset(bare).size();
    EXPECT_LT(bytes, 8'000u);
    EXPECT_GT(encode_scene_asset(asset, AssetLayout::Numbers).size() - encode_scene_asset(bare).size(),
              5 * bytes);
    const SceneAsset strands = decode_asset_strands(encode_scene_asset(asset)).value();
    EXPECT_EQ(strands.rest_position_m, asset.rest_position_m);
    EXPECT_TRUE(strands.head.position_m.empty());
  }
}

TEST(SceneAsset, AHeadThatIsNotWhatItsFormMakesIsToldByNumbers) {
  SceneAsset asset = asset_with_head(HeadFit::BustOnly);
  Mesh moved = asset.head;
  moved.position_m[7].x += 1.0f / 1024.0f;
  asset.head = as_sent(moved);
  expect_back(asset, AssetLayout::Numbers);
  EXPECT_EQ(encode_scene_asset(asset), encode_scene_asset(asset, AssetLayout::Numbers));
}

/// The payload with bytes of the head's form changed.
std::vector<std::byte> with_form_bytes(size_t at, std::span<const std::byte> bytes) {
  const SceneAsset asset = asset_with_head(HeadFit::BustOnly);
  SceneAsset bare = asset;
  bare.head = {};
  auto payload = encode_scene_asset(asset);
  constexpr size_t kPartHead = 5;  // number and size
  std::copy(bytes.begin(), bytes.end(),
            payload.begin() + static_cast<ptrdiff_t>(encode_scene_asset(bare).size() + kPartHead + at));
  return payload;
}

TEST(SceneAsset, AFormThatIsNoneIsRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const auto& [at, value] : {std::pair<size_t, double>{8, nan},
                                  {16, 1e9},
                                  {32, 0.0},
                                  {40, -1.0},
                                  {48, nan},
                                  {48, 1e300},
                                  {56, -0.1},
                                  {56, 1e9},
                                  {56, nan}}) {
    const auto refused = decode_scene_asset(with_form_bytes(at, std::as_bytes(std::span(&value, 1))));
    ASSERT_FALSE(refused) << at << " " << value;
    EXPECT_EQ(refused.error().code, ErrorCode::BadInput) << refused.error().to_string();
  }
  for (const auto& [at, value] : {std::pair<size_t, uint8_t>{64, 31}, {64, 255}, {65, 2}})
    EXPECT_FALSE(decode_scene_asset(with_form_bytes(at, std::as_bytes(std::span(&value, 1))))) << at;
}

TEST(SceneAsset, AProgramThatMakesAnotherHeadAsksForNumbers) {
  const uint8_t other = 0x5a;  // of the hash
  const auto decoded = decode_scene_asset(with_form_bytes(3, std::as_bytes(std::span(&other, 1))));
  ASSERT_FALSE(decoded);
  EXPECT_EQ(decoded.error().code, ErrorCode::Unavailable) << "a viewer tries again";
  EXPECT_EQ(newest_asset_layout(), AssetLayout::Numbers);
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
  expect_back(asset, AssetLayout::Floats);
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
  for (const AssetLayout layout : {AssetLayout::Floats, AssetLayout::Numbers}) {
    const auto good = encode_scene_asset(sample_asset(10, 4), layout);
    const auto with_number = [&](size_t index, uint32_t value) {
      auto bytes = good;
      std::memcpy(bytes.data() + 4 * index, &value, 4);
      return decode_scene_asset(bytes);
    };
    EXPECT_EQ(with_number(0, 4).error().code, ErrorCode::BadInput);  // layout
    for (const uint32_t strands : {0u, kMaxStrandCount + 1, ~0u})
      EXPECT_EQ(with_number(1, strands).error().code, ErrorCode::LimitExceeded) << strands;
    for (const uint32_t vertices : {0u, 1u, kMaxVertexCount + 1, ~0u})
      EXPECT_EQ(with_number(2, vertices).error().code, ErrorCode::LimitExceeded) << vertices;
    EXPECT_EQ(with_number(3, 10 * kMaxTrianglesPerStrand + 1).error().code, ErrorCode::LimitExceeded);
    EXPECT_EQ(with_number(4, kMaxMeshVertices + 1).error().code, ErrorCode::LimitExceeded);
    EXPECT_EQ(with_number(5, kMaxMeshTriangles + 1).error().code, ErrorCode::LimitExceeded);
    // Within the limits, but not what the bytes hold.
    for (const size_t index : {1, 2, 3, 4, 5})
      for (const int more : {-1, 1}) {
        uint32_t count = 0;
        std::memcpy(&count, good.data() + 4 * index, 4);
        EXPECT_FALSE(with_number(index, count + static_cast<uint32_t>(more))) << index << " " << more;
      }
  }
}

}  // namespace
}  // namespace strandcast::scene_asset_test

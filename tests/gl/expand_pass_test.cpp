#include "common/render/passes/expand_pass.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "shaders/shared/limits.h"
#include "tests/support/gl_fixture.h"
#include "tests/support/strand_reference.h"

namespace strandcast::expand_pass_test {
namespace {

using reference::Keys;

constexpr FollowerDesc kPlainFollowers{4, 0.0f, 0.0f, 0.0f};
constexpr FollowerDesc kStyledFollowers{5, 0.6f, 0.004f, 0.2f};

// Strands of 0.3 m with bends, roots on a 5 mm grid.
Keys make_keys(uint32_t strand_count, uint32_t vertex_count) {
  Keys keys{strand_count, vertex_count, {}};
  keys.position_m.resize(static_cast<size_t>(strand_count) * vertex_count);
  std::mt19937 random(11);
  std::uniform_real_distribution<float> jitter(-0.002f, 0.002f);
  for (uint32_t v = 0; v < vertex_count; ++v)
    for (uint32_t s = 0; s < strand_count; ++s) {
      const float along = static_cast<float>(v) / static_cast<float>(vertex_count - 1);
      const glm::vec3 root(0.005f * static_cast<float>(s % 50), 0.0f, 0.005f * static_cast<float>(s / 50));
      keys.position_m[static_cast<size_t>(v) * strand_count + s] =
          root + glm::vec3(0.02f * std::sin(9.0f * along), -0.3f * along, 0.01f * along) +
          glm::vec3(jitter(random), jitter(random), jitter(random));
    }
  return keys;
}

SceneAsset make_asset(const Keys& keys, const std::vector<RootTriangle>& triangles) {
  SceneAsset asset;
  asset.strand_count = keys.strand_count;
  asset.vertex_count = keys.vertex_count;
  asset.rest_position_m = keys.position_m;
  asset.triangle = triangles;
  return asset;
}

/// A program with its buffers.
class Expander {
 public:
  Expander(const Keys& keys, const std::vector<RootTriangle>& triangles, const FollowerDesc& followers,
           uint32_t max_segments)
      : keys_(keys.strand_count, keys.vertex_count),
        sizes_(keys_, static_cast<uint32_t>(triangles.size()), followers.per_triangle),
        expanded_(sizes_.buffer_bytes(max_segments)) {
    auto made = StrandExpander::make(gl::ShaderLibrary(), make_asset(keys, triangles), followers);
    if (!made) {
      ADD_FAILURE() << made.error().to_string();
      return;
    }
    expander_ = std::move(*made);
    keys_.allocate();
    keys_.position().write(keys.position_m);
    expanded_.allocate();
  }
  uint32_t run(uint32_t first, uint32_t count, const ExpandLevel& level) const {
    return expander_.run(keys_, expanded_, first, count, level);
  }
  uint32_t strand_count(uint32_t followers) const { return sizes_.strand_count(followers); }
  uint32_t max_followers() const { return sizes_.max_followers(); }
  uint32_t segments_per_strand(uint32_t segments) const { return sizes_.segments_per_strand(segments); }
  const gl::Buffer& expanded() const { return expanded_.vertex(); }
  uint64_t size_bytes() const { return keys_.size_bytes() + expanded_.size_bytes() + expander_.size_bytes(); }

 private:
  KeyStrands keys_;
  ExpandSizes sizes_;
  ExpandedStrands expanded_;
  StrandExpander expander_;
};

class ExpandPassTest : public GlTest {
 protected:
  void SetUp() override {
    GlTest::SetUp();
    framebuffer_ = gl::Framebuffer::without_attachments("expand test");
    framebuffer_.bind();
  }

  // All points of the strands first .. first + count - 1, strand-major, in order along the strand.
  static std::vector<ExpandedVertex> expand(const Expander& pass, uint32_t first, uint32_t count,
                                            uint32_t segments) {
    const uint32_t written = pass.run(first, count, {segments, pass.max_followers()});
    const uint32_t per_strand = pass.segments_per_strand(segments);
    EXPECT_EQ(written, count * per_strand);
    std::vector<ExpandedVertex> raw(2 * static_cast<size_t>(written));
    pass.expanded().read(0, std::as_writable_bytes(std::span(raw)));
    std::vector<ExpandedVertex> ordered(static_cast<size_t>(count) * (per_strand + 1));
    std::vector<int> seen(ordered.size(), 0);
    for (size_t i = 0; i < raw.size(); ++i) {
      const auto point = static_cast<uint32_t>(std::lround(raw[i].along * static_cast<float>(per_strand)));
      if (raw[i].strand < first || raw[i].strand >= first + count || point > per_strand) {
        ADD_FAILURE() << "vertex " << i << " belongs to strand " << raw[i].strand << ", point " << point;
        return {};
      }
      const size_t slot = static_cast<size_t>(raw[i].strand - first) * (per_strand + 1) + point;
      ordered[slot] = raw[i];
      ++seen[slot];
      // The two ends of a segment are neighbours on the same strand, root side first.
      if (i % 2 == 1) {
        EXPECT_EQ(raw[i].strand, raw[i - 1].strand);
        EXPECT_NEAR((raw[i].along - raw[i - 1].along) * static_cast<float>(per_strand), 1.0f, 1e-3f);
      }
    }
    for (size_t slot = 0; slot < seen.size(); ++slot) {
      const size_t point = slot % (per_strand + 1);
      EXPECT_EQ(seen[slot], point == 0 || point == per_strand ? 1 : 2) << "slot " << slot;
    }
    return ordered;
  }

  gl::Framebuffer framebuffer_;
};

TEST_F(ExpandPassTest, CurvesPassThroughTheVerticesBitForBit) {
  const Keys keys = make_keys(70, 16);
  const uint32_t segments = 3;
  const Expander pass(keys, {}, {}, segments);
  const auto points = expand(pass, 0, 70, segments);
  ASSERT_EQ(points.size(), 70u * 46u);
  for (uint32_t s = 0; s < 70; ++s)
    for (uint32_t v = 0; v < 16; ++v)
      EXPECT_EQ(points[s * 46 + v * segments].position_m, keys.position_m[v * 70 + s]);
}

TEST_F(ExpandPassTest, KeyStrandsMatchTheReference) {
  const Keys keys = make_keys(70, 16);
  const Expander pass(keys, {}, {}, 4);
  const auto points = expand(pass, 0, 70, 4);
  ASSERT_EQ(points.size(), 70u * 61u);
  for (uint32_t s = 0; s < 70; ++s)
    for (uint32_t i = 0; i <= 60; ++i) {
      const uint32_t gap = std::min(i / 4, 14u);
      const auto expected = reference::curve_point(keys, s, gap, (i - 4 * gap) / 4.0);
      const ExpandedVertex& point = points[s * 61 + i];
      EXPECT_LT(glm::length(glm::dvec3(point.position_m) - expected.position_m), 1e-6);
      EXPECT_LT(glm::length(glm::dvec3(point.tangent) - glm::normalize(expected.derivative)), 1e-4);
    }
}

TEST_F(ExpandPassTest, StraightAndQuadraticStrandsAreExact) {
  // Strand 0 is straight with even steps, strand 1 a parabola in the parameter: exact everywhere, and inside.
  Keys keys{2, 8, {}};
  for (int v = 0; v < 8; ++v) {
    const auto x = static_cast<float>(v);
    keys.position_m.emplace_back(0.01f * x, -0.02f * x, 0.005f * x);
    keys.position_m.emplace_back(0.01f * x, -0.002f * x * x, 0.0f);
  }
  const Expander pass(keys, {}, {}, 8);
  const auto points = expand(pass, 0, 2, 8);
  ASSERT_EQ(points.size(), 2u * 57u);
  for (int i = 0; i <= 56; ++i) {
    const double x = i / 8.0;
    EXPECT_LT(glm::length(glm::dvec3(points[i].position_m) - x * glm::dvec3(0.01, -0.02, 0.005)), 1e-7);
    if (x >= 1.0 && x <= 6.0) {
      EXPECT_LT(
          glm::length(glm::dvec3(points[57 + i].position_m) - glm::dvec3(0.01 * x, -0.002 * x * x, 0.0)),
          1e-7);
    }
  }
}

TEST_F(ExpandPassTest, FollowersMatchTheReference) {
  const Keys keys = make_keys(60, 12);
  const std::vector<RootTriangle> triangles{{0, 1, 50}, {1, 50, 51}, {7, 8, 57}};
  const Expander pass(keys, triangles, kStyledFollowers, 3);
  ASSERT_EQ(pass.strand_count(pass.max_followers()), 60u + 15u);
  const auto points = expand(pass, 60, 15, 3);
  ASSERT_EQ(points.size(), 15u * 34u);
  const reference::FollowerStyle style{kStyledFollowers.clump, kStyledFollowers.variation_m,
                                       kStyledFollowers.shorten};
  for (uint32_t f = 0; f < 15; ++f)
    for (uint32_t i = 0; i <= 33; ++i) {
      const auto expected = reference::follower_point(keys, triangles[f / 5], f, i / 33.0, style);
      EXPECT_LT(glm::length(glm::dvec3(points[f * 34 + i].position_m) - expected.position_m), 2e-6)
          << f << " " << i;
    }
}

TEST_F(ExpandPassTest, FollowerRootsStayInTheirTriangle) {
  const Keys keys = make_keys(60, 4);
  const std::vector<RootTriangle> triangles{{0, 1, 50}, {3, 4, 53}};
  FollowerDesc followers = kStyledFollowers;
  followers.per_triangle = 40;
  const Expander pass(keys, triangles, followers, 1);
  const auto points = expand(pass, 60, 80, 1);
  ASSERT_EQ(points.size(), 80u * 4u);
  for (uint32_t f = 0; f < 80; ++f) {
    const RootTriangle corner = triangles[f / 40];
    const glm::dvec3 a(keys.position_m[corner.x]), b(keys.position_m[corner.y]), c(keys.position_m[corner.z]);
    const glm::dvec3 p(points[f * 4].position_m);
    const auto area = [](const glm::dvec3& u, const glm::dvec3& v) { return glm::length(glm::cross(u, v)); };
    const double whole = area(b - a, c - a);
    EXPECT_NEAR(area(a - p, b - p) + area(b - p, c - p) + area(c - p, a - p), whole, 1e-4 * whole);
  }
}

TEST_F(ExpandPassTest, FollowersOfParallelKeysHaveTheirLength) {
  Keys keys = make_keys(3, 10);
  for (uint32_t v = 0; v < 10; ++v) {
    keys.position_m[3 * v + 1] = keys.position_m[3 * v] + glm::vec3(0.004f, 0, 0);
    keys.position_m[3 * v + 2] = keys.position_m[3 * v] + glm::vec3(0, 0, 0.004f);
  }
  const Expander pass(keys, {{0, 1, 2}}, kPlainFollowers, 4);
  const auto points = expand(pass, 0, 7, 4);
  ASSERT_EQ(points.size(), 7u * 37u);
  const auto length_m = [&](uint32_t strand) {
    double sum = 0.0;
    for (uint32_t i = 0; i < 36; ++i)
      sum += glm::length(glm::dvec3(points[strand * 37 + i + 1].position_m) -
                         glm::dvec3(points[strand * 37 + i].position_m));
    return sum;
  };
  for (uint32_t strand = 1; strand < 7; ++strand) EXPECT_NEAR(length_m(strand), length_m(0), 1e-5);
}

TEST_F(ExpandPassTest, MoreVerticesThanOneDrawMayHoldAreAllRight) {
  // Software drivers index tessellated vertices of a draw with 16 bits and say nothing when that overflows.
  const uint32_t strands = 3000;
  const Keys keys = make_keys(strands, 32);
  const uint32_t segments = 1;
  const Expander pass(keys, {}, {}, segments);
  ASSERT_GT(strands * 32, shader::kMaxTessellatedVerticesPerDraw);
  const auto points = expand(pass, 0, strands, segments);
  ASSERT_EQ(points.size(), strands * 32u);
  for (const uint32_t s : {0u, 1u, 2047u, 2048u, 2999u})
    for (uint32_t v = 0; v < 32; ++v)
      EXPECT_EQ(points[s * 32 + v].position_m, keys.position_m[v * strands + s]);
}

TEST_F(ExpandPassTest, StrandsLongerThanATessellationLevelComeInRuns) {
  // 63 gaps x 8 segments = 504, tessellated 64 at a time.
  const Keys keys = make_keys(67, 64);
  const Expander pass(keys, {}, {}, 8);
  const auto points = expand(pass, 0, 67, 8);
  ASSERT_EQ(points.size(), 67u * 505u);
  for (const uint32_t s : {0u, 63u, 64u, 66u})
    for (uint32_t i = 0; i <= 504; i += 7) {
      const uint32_t gap = std::min(i / 8, 62u);
      const auto expected = reference::curve_point(keys, s, gap, (i - 8 * gap) / 8.0);
      EXPECT_LT(glm::length(glm::dvec3(points[s * 505 + i].position_m) - expected.position_m), 1e-6);
    }
}

TEST_F(ExpandPassTest, ABatchEqualsTheSameStrandsOfTheWhole) {
  const Keys keys = make_keys(200, 6);
  const Expander pass(keys, {{0, 1, 50}, {10, 11, 60}}, kStyledFollowers, 2);
  const auto whole = expand(pass, 0, pass.strand_count(pass.max_followers()), 2);
  const auto batch = expand(pass, 150, 57, 2);
  ASSERT_EQ(batch.size(), 57u * 11u);
  for (size_t i = 0; i < batch.size(); ++i) EXPECT_EQ(batch[i].position_m, whole[150 * 11 + i].position_m);
}

TEST_F(ExpandPassTest, FewerFollowersAreSomeOfTheSameOnes) {
  const Keys keys = make_keys(60, 5);
  const Expander pass(keys, {{0, 1, 50}, {3, 4, 53}}, kStyledFollowers, 1);
  const auto points_of = [&](uint32_t followers) {
    std::vector<ExpandedVertex> raw(2 * static_cast<size_t>(pass.run(60, 2 * followers, {1, followers})));
    pass.expanded().read(0, std::as_writable_bytes(std::span(raw)));
    return raw;
  };
  const auto all = points_of(5), some = points_of(2);
  ASSERT_EQ(some.size(), 4u * 4u * 2u);
  for (const ExpandedVertex& point : some)
    EXPECT_TRUE(std::any_of(all.begin(), all.end(), [&](const ExpandedVertex& other) {
      return other.position_m == point.position_m && other.tangent == point.tangent;
    }));
}

TEST_F(ExpandPassTest, CoincidentVerticesGiveFiniteUnitTangents) {
  Keys keys{4, 5, {}};
  for (int v = 0; v < 5; ++v) {
    keys.position_m.emplace_back(0.0f);                                  // all in one point
    keys.position_m.emplace_back(0.0f, v < 3 ? 0.0f : -0.1f * v, 0.0f);  // three at the root
    keys.position_m.emplace_back(v % 2 == 0 ? 0.1f : -0.1f, 0.0f,
                                 0.0f);                    // back and forth: zero Catmull-Rom tangents
    keys.position_m.emplace_back(1e-20f * v, 0.0f, 0.0f);  // shorter than a float can square
  }
  const Expander pass(keys, {{0, 1, 2}, {0, 0, 0}}, kStyledFollowers, 4);
  for (const ExpandedVertex& point : expand(pass, 0, pass.strand_count(pass.max_followers()), 4)) {
    for (int axis = 0; axis < 3; ++axis) EXPECT_TRUE(std::isfinite(point.position_m[axis]));
    EXPECT_NEAR(glm::length(point.tangent), 1.0f, 1e-3f);
  }
}

TEST_F(ExpandPassTest, WithoutFollowersNothingIsAllocatedForThem) {
  const Keys keys = make_keys(10, 6);
  const std::vector<RootTriangle> triangles{{0, 1, 2}, {3, 4, 5}};
  const Expander none(keys, triangles, FollowerDesc{}, 2);
  const Expander some(keys, triangles, kPlainFollowers, 2);
  EXPECT_EQ(none.strand_count(none.max_followers()), 10u);
  EXPECT_EQ(none.size_bytes(), 10 * 6 * sizeof(glm::vec3) + 10 * 10 * 2 * sizeof(ExpandedVertex));
  EXPECT_EQ(some.size_bytes(),
            none.size_bytes() + 2 * sizeof(RootTriangle) + 8 * 10 * 2 * sizeof(ExpandedVertex));
}

}  // namespace
}  // namespace strandcast::expand_pass_test

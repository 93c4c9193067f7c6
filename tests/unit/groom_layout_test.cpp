// Laws of what is done with a groom: validation, order, resampling, root triangles and prefixes.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include "common/base/hash.h"
#include "common/groom/procedural.h"
#include "common/groom/resample.h"
#include "common/groom/tfx_loader.h"
#include "common/math/point_tree.h"
#include "tests/support/groom_files.h"

namespace strandcast::groom_layout_test {
namespace {

using ::testing::HasSubstr;

Groom make_groom(const std::vector<std::vector<glm::vec3>>& strands) {
  Groom groom;
  groom.offset.push_back(0);
  for (const auto& strand : strands) {
    groom.rest_position_m.insert(groom.rest_position_m.end(), strand.begin(), strand.end());
    groom.offset.push_back(static_cast<uint32_t>(groom.rest_position_m.size()));
  }
  return with_pinning(std::move(groom), Pinning::Root);
}

/// Strands of length 0.1 straight up from the given roots.
Groom upright(const std::vector<glm::vec3>& roots) {
  std::vector<std::vector<glm::vec3>> strands;
  for (const auto& root : roots)
    strands.push_back({root, root + glm::vec3(0, 0.05f, 0), root + glm::vec3(0, 0.1f, 0)});
  return make_groom(strands);
}

float random_unit(uint32_t i) {
  return unit_float(mix_u32(i + 77));
}

Groom grown(uint32_t strand_count) {
  ProceduralGroomOptions options;
  options.strand_count = strand_count;
  return *grow_groom(make_scalp_cap(glm::vec3(0.0f), 0.095f, 2000), options);
}

TEST(Groom, ValidateNamesWhatIsWrong) {
  const Groom good = upright({{0, 0, 0}, {1, 0, 0}});
  EXPECT_TRUE(validate(good));
  const auto refused = [&](auto change) {
    Groom broken = good;
    change(broken);
    const Status status = validate(broken);
    return status ? std::string("accepted") : status.error().to_string();
  };
  EXPECT_THAT(refused([](Groom& g) { g = Groom{}; }), HasSubstr("no strands"));
  EXPECT_THAT(refused([](Groom& g) { g.offset[1] = 5; }), HasSubstr("strand 1 runs from vertex 5 to 6"));
  EXPECT_THAT(refused([](Groom& g) { g.offset[1] = 900; }), HasSubstr("strand 0 runs from vertex 0 to 900"));
  EXPECT_THAT(refused([](Groom& g) { g.offset.back() = 7; }), HasSubstr("do not belong together"));
  EXPECT_THAT(refused([](Groom& g) { g.pinned.pop_back(); }), HasSubstr("do not belong together"));
  EXPECT_THAT(refused([](Groom& g) { g.pinned[3] = 0; }), HasSubstr("root of strand 1"));
  EXPECT_THAT(refused([](Groom& g) { g.root_uv.resize(1); }), HasSubstr("1 root coordinates for 2 strands"));
  EXPECT_THAT(refused([](Groom& g) { g.rest_position_m[4].z = NAN; }), HasSubstr("strand 1 vertex 1"));
  EXPECT_THAT(refused([](Groom& g) { g.rest_position_m[4].z = 100.1f; }), HasSubstr("100.1"));
  EXPECT_THAT(refused([](Groom& g) { g.offset.assign(kMaxStrandCount + 2, 0); }),
              HasSubstr("200001 strands"));
}

TEST(Groom, ReorderCarriesEverythingOfAStrand) {
  Groom groom =
      make_groom({{{0, 0, 0}, {0, 1, 0}}, {{1, 0, 0}, {1, 1, 0}, {1, 2, 0}}, {{2, 0, 0}, {2, 1, 0}}});
  groom.root_uv = {{0.0f, 0.0f}, {0.1f, 0.0f}, {0.2f, 0.0f}};
  groom.pinned[3] = 1;  // strand 1 vertex 1
  const Groom sorted = reorder(groom, {2, 1, 0});
  EXPECT_EQ(sorted.offset, (std::vector<uint32_t>{0, 2, 5, 7}));
  EXPECT_EQ(sorted.rest_position_m[3], glm::vec3(1, 1, 0));
  EXPECT_EQ(sorted.pinned, (std::vector<uint8_t>{1, 0, 1, 1, 0, 1, 0}));
  EXPECT_EQ(sorted.root_uv[0].x, 0.2f);
  const Groom back = reorder(sorted, {2, 1, 0});
  EXPECT_EQ(back.rest_position_m, groom.rest_position_m);
  EXPECT_EQ(back.pinned, groom.pinned);
}

TEST(Resample, KeepsEndsBitForBitAndSpacesEvenly) {
  // A quarter circle of radius 0.1 with uneven vertices.
  std::vector<glm::vec3> arc;
  for (int i = 0; i <= 200; ++i) {
    const float angle = 1.5707963f * std::pow(static_cast<float>(i) / 200.0f, 2.0f);
    arc.push_back({0.1f * std::sin(angle), 0.1f * std::cos(angle), 0.3f});
  }
  const Groom groom = make_groom({arc});
  for (const uint32_t count : {2u, 3u, 8u, 16u, 64u}) {
    const Groom result = resample(groom, count);
    ASSERT_EQ(result.rest_position_m.size(), count);
    EXPECT_EQ(result.rest_position_m.front(), arc.front());
    EXPECT_EQ(result.rest_position_m.back(), arc.back());
    const float chord = glm::distance(result.rest_position_m[0], result.rest_position_m[1]);
    for (uint32_t i = 1; i < count; ++i) {
      EXPECT_NEAR(glm::distance(result.rest_position_m[i - 1], result.rest_position_m[i]), chord,
                  1e-3f * chord);
    }
    // A chord over an angle a is shorter than its arc by the factor sin(a/2) / (a/2).
    const double half = 1.5707963 / (count - 1) / 2.0;
    EXPECT_NEAR(result.length_m(0), groom.length_m(0) * std::sin(half) / half, 1e-5 * groom.length_m(0));
  }
}

TEST(Resample, NeverLengthensAndIsExactForStraightStrands) {
  std::vector<std::vector<glm::vec3>> strands;
  for (uint32_t s = 0; s < 50; ++s) {
    std::vector<glm::vec3> strand{{0, 0, 0}};
    for (uint32_t i = 0; i < 2 + s; ++i) {
      strand.push_back(strand.back() + 0.01f * glm::vec3(random_unit(s * 999 + i * 3),
                                                         random_unit(s * 999 + i * 3 + 1),
                                                         random_unit(s * 999 + i * 3 + 2)));
    }
    strands.push_back(strand);
  }
  strands.push_back({{0, 0, 0}, {0, 0.001f, 0}, {0, 0.5f, 0}});
  const Groom groom = make_groom(strands);
  const Groom result = resample(groom, 16);
  EXPECT_EQ(result.uniform_vertex_count(), 16u);
  EXPECT_TRUE(validate(result));
  for (uint32_t s = 0; s < groom.strand_count(); ++s)
    EXPECT_LE(result.length_m(s), groom.length_m(s) * 1.000001f);
  EXPECT_NEAR(result.length_m(50), 0.5f, 1e-6f);
  EXPECT_NEAR(result.rest_position_m[result.offset[50] + 3].y, 0.1f, 1e-6f);
}

TEST(Resample, DegenerateStrandsStayFinite) {
  const Groom groom = make_groom({{{1, 2, 3}, {1, 2, 3}, {1, 2, 3}},
                                  {{0, 0, 0}, {1e-30f, 0, 0}},
                                  {{0, 0, 0}, {0, 0, 0}, {0, 1e-7f, 0}, {0, 1e-7f, 0}}});
  const Groom result = resample(groom, 9);
  EXPECT_TRUE(validate(result));
  for (uint32_t i = 0; i < 9; ++i) EXPECT_EQ(result.rest_position_m[i], glm::vec3(1, 2, 3));
  EXPECT_NEAR(result.rest_position_m[18 + 4].y, 0.5e-7f, 1e-10f);
}

TEST(Resample, PinsStayAtTheirEnds) {
  const std::vector<glm::vec3> strand = {{0, 0, 0}, {0, 1, 0}, {0, 2, 0}, {0, 3, 0}, {0, 4, 0}, {0, 5, 0}};
  for (const Pinning pinning : {Pinning::Root, Pinning::RootPair, Pinning::BothEnds}) {
    const Groom groom = with_pinning(make_groom({strand, strand}), pinning);
    for (const uint32_t count : {2u, 4u, 5u, 16u}) {
      const Groom result = resample(groom, count);
      EXPECT_EQ(result.pinned, with_pinning(result, pinning).pinned) << count;
    }
  }
}

TEST(PointTree, FindsWhatAFullSearchFinds) {
  std::vector<glm::vec3> points;
  for (uint32_t i = 0; i < 700; ++i) {
    points.push_back({random_unit(3 * i), random_unit(3 * i + 1), 0.1f * random_unit(3 * i + 2)});
    if (i % 5 == 0) points.push_back(points.back());  // coincident
  }
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) points.emplace_back(0.1f * x, 0.1f * y, 0.5f);  // many are as far away
  for (int i = 0; i < 60; ++i)
    points.insert(points.begin() + 11 * i, {0.4f, 0.5f, 0.05f});  // more than a leaf holds
  const PointTree tree(points);
  std::vector<glm::vec3> centers;
  for (uint32_t i = 0; i < points.size(); i += 7) centers.push_back(points[i]);
  for (const glm::vec3& center : std::vector(centers)) centers.push_back(100.0f * (center - 0.5f));
  for (const glm::vec3& center : centers) {
    std::vector<PointTree::Neighbour> expected;
    for (uint32_t i = 0; i < points.size(); ++i) {
      const glm::vec3 offset = points[i] - center;
      expected.push_back({glm::dot(offset, offset), i});
    }
    std::sort(expected.begin(), expected.end());
    const auto found = tree.nearest(center, 12);
    ASSERT_EQ(found.size(), 12u);
    for (size_t k = 0; k < 12; ++k) {
      ASSERT_EQ(found[k].distance_squared, expected[k].distance_squared);
      ASSERT_EQ(found[k].index, expected[k].index) << "of equal ones the first";
    }
  }
  EXPECT_EQ(tree.nearest(points[0], 5000).size(), points.size());
  EXPECT_TRUE(PointTree({}).nearest(glm::vec3(0), 3).empty());
}

/// Valid and distinct corners, no triangle twice.
void expect_proper(const Groom& groom, const std::vector<RootTriangle>& triangles) {
  std::set<std::array<uint32_t, 3>> seen;
  for (const RootTriangle& triangle : triangles) {
    std::array<uint32_t, 3> corners = {triangle.x, triangle.y, triangle.z};
    std::sort(corners.begin(), corners.end());
    ASSERT_LT(corners[2], groom.strand_count());
    ASSERT_LT(corners[0], corners[1]);
    ASSERT_LT(corners[1], corners[2]);
    ASSERT_TRUE(seen.insert(corners).second);
  }
}

TEST(RootTriangles, CoverAScalpWithAboutTwoPerStrand) {
  const Groom groom = grown(3000);
  const auto triangles = make_root_triangles(groom);
  expect_proper(groom, triangles);
  // Euler: a triangulated disc of n points has 2n - 2 - b triangles with b on its rim.
  EXPECT_GT(triangles.size(), 3000u * 17 / 10);
  EXPECT_LT(triangles.size(), 3000u * 2);
  EXPECT_EQ(triangles, make_root_triangles(groom));
  for (const RootTriangle& triangle : triangles) {
    for (int i = 0; i < 3; ++i) {
      const glm::vec3& a = groom.rest_position_m[groom.offset[triangle[i]]];
      const glm::vec3& b = groom.rest_position_m[groom.offset[triangle[(i + 1) % 3]]];
      // Roots are about sqrt(area / n) = 4.6 mm apart, but for those along the parting.
      ASSERT_LT(glm::distance(a, b), 0.014f);
    }
  }
}

TEST(RootTriangles, TileARegularGridOnce) {
  std::vector<glm::vec3> roots;
  for (int x = 0; x < 12; ++x) {
    for (int z = 0; z < 12; ++z)
      roots.push_back({0.01f * static_cast<float>(x), 0.0f, 0.01f * static_cast<float>(z)});
  }
  const Groom groom = upright(roots);
  const auto triangles = make_root_triangles(groom);
  expect_proper(groom, triangles);
  double area = 0.0;
  for (const RootTriangle& t : triangles) {
    area += 0.5 * glm::length(glm::cross(roots[t.y] - roots[t.x], roots[t.z] - roots[t.x]));
  }
  EXPECT_NEAR(area, 0.11 * 0.11, 0.02 * 0.11 * 0.11);
}

TEST(RootTriangles, DoNotBridgeAGapBetweenTwoPatches) {
  std::vector<glm::vec3> roots;
  for (uint32_t i = 0; i < 400; ++i) {
    const float shift = i < 200 ? 0.0f : 0.13f;  // patches 0.1 wide, a gap of 0.03, spacing about 0.007
    roots.push_back({0.1f * random_unit(2 * i) + shift, 0.0f, 0.1f * random_unit(2 * i + 1)});
  }
  const auto triangles = make_root_triangles(upright(roots));
  EXPECT_GT(triangles.size(), 400u);
  for (const RootTriangle& triangle : triangles) {
    const bool is_left = triangle.x < 200;
    ASSERT_EQ(triangle.y < 200, is_left);
    ASSERT_EQ(triangle.z < 200, is_left);
  }
}

TEST(RootTriangles, CoverThePartingOfCloseRoots) {
  std::vector<std::vector<glm::vec3>> strands;
  for (uint32_t i = 0; i < 400; ++i) {
    const glm::vec3 root(0.2f * random_unit(2 * i) - 0.1f, 0.0f, 0.2f * random_unit(2 * i + 1));
    const glm::vec3 comb(root.x < 0.0f ? -0.1f : 0.1f, 0.02f, 0.0f);
    strands.push_back({root, root + 0.5f * comb, root + comb});
  }
  const auto triangles = make_root_triangles(make_groom(strands));
  const auto is_left = [&](uint32_t strand) { return strands[strand][0].x < 0.0f; };
  const auto across = std::count_if(triangles.begin(), triangles.end(), [&](const RootTriangle& t) {
    return is_left(t.x) != is_left(t.y) || is_left(t.x) != is_left(t.z);
  });
  // About two per spacing along the parting, of 20 x 20 roots.
  EXPECT_GT(across, 20);
  EXPECT_LT(across, 80);
}

TEST(RootTriangles, SurviveDegenerateRoots) {
  EXPECT_TRUE(make_root_triangles(upright({{0, 0, 0}, {1, 0, 0}})).empty());
  EXPECT_TRUE(make_root_triangles(upright(std::vector<glm::vec3>(500, glm::vec3(1.0f)))).empty());
  std::vector<glm::vec3> line;
  for (int i = 0; i < 100; ++i) line.push_back({0.01f * static_cast<float>(i), 0, 0});
  const Groom on_line = upright(line);
  expect_proper(on_line, make_root_triangles(on_line));
  // Twice the same roots: only one of each pair carries triangles.
  Groom once = grown(500);
  std::vector<glm::vec3> twice;
  for (uint32_t s = 0; s < 500; ++s) twice.push_back(once.rest_position_m[once.offset[s]]);
  for (uint32_t s = 0; s < 500; ++s) twice.push_back(twice[s]);
  const Groom doubled = upright(twice);
  const auto triangles = make_root_triangles(doubled);
  expect_proper(doubled, triangles);
  EXPECT_GT(triangles.size(), 800u);
}

TEST(RootTriangles, RealGroomsGetOneToTwoPerStrand) {
  REQUIRE_SHARED_DATA();
  for (const char* name :
       {"Ratboy_mohawk.tfx", "TestHair1.tfx", "ponytail_side.tfx", "sintel_11400x16.tfx"}) {
    const auto stated = load_tfx(test::shared_data() / "grooms" / name);
    ASSERT_TRUE(stated);
    const auto triangles = make_root_triangles(stated->groom);
    expect_proper(stated->groom, triangles);
    const double ratio = static_cast<double>(triangles.size()) / stated->groom.strand_count();
    EXPECT_GT(ratio, 0.9) << name;
    EXPECT_LT(ratio, 2.0) << name;
  }
}

TEST(PrefixOrder, IsAPermutation) {
  Groom groom = grown(1000);
  for (uint32_t s = 0; s < 100; ++s)
    groom.rest_position_m[groom.offset[s]] = glm::vec3(0.01f);  // coincident roots
  std::vector<uint32_t> order = make_prefix_order(groom);
  EXPECT_EQ(order, make_prefix_order(groom));
  std::sort(order.begin(), order.end());
  for (uint32_t i = 0; i < order.size(); ++i) ASSERT_EQ(order[i], i);
  EXPECT_EQ(order.size(), 1000u);
}

/// Cover radius: the largest distance of a root to the prefix. n discs of that radius cover the scalp, so it
/// cannot be below sqrt(A / (pi n)); a random subset has gaps of about sqrt(A ln(n) / n), and file order
/// misses whole regions.
TEST(PrefixOrder, EveryPrefixCoversTheHead) {
  // Hostile order: sorted along x.
  Groom groom = grown(4000);
  std::vector<uint32_t> by_x(4000);
  std::iota(by_x.begin(), by_x.end(), 0u);
  std::sort(by_x.begin(), by_x.end(), [&](uint32_t a, uint32_t b) {
    return groom.rest_position_m[groom.offset[a]].x < groom.rest_position_m[groom.offset[b]].x;
  });
  groom = reorder(groom, by_x);
  const std::vector<uint32_t> order = make_prefix_order(groom);
  const double area = 0.0567;  // 2 pi r^2 (1 - cos 1.56)
  for (const uint32_t prefix : {10u, 30u, 100u, 300u, 1000u, 2000u}) {
    std::vector<glm::vec3> covered;
    for (uint32_t i = 0; i < prefix; ++i) covered.push_back(groom.rest_position_m[groom.offset[order[i]]]);
    const PointTree tree(covered);
    float cover_m = 0.0f;
    for (uint32_t s = 0; s < groom.strand_count(); ++s) {
      const auto nearest = tree.nearest(groom.rest_position_m[groom.offset[s]], 1);
      cover_m = std::max(cover_m, std::sqrt(nearest[0].distance_squared));
    }
    EXPECT_LT(cover_m, 2.6 * std::sqrt(area / (3.14159 * prefix))) << prefix;
  }
}

}  // namespace
}  // namespace strandcast::groom_layout_test

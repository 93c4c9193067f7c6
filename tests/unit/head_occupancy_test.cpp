// Where a head is solid: known shapes, whole and broken, and what is bounded.
#include "common/render/head_occupancy.h"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <glm/gtc/constants.hpp>
#include <limits>
#include <utility>

#include "common/strands/head/head_field.h"

namespace strandcast::head_occupancy_test {
namespace {

constexpr float kRadiusM = 0.1f;

/// A closed ball; `columns` around, half as many from pole to pole.
Mesh ball(float radius_m, int columns = 48) {
  Mesh mesh;
  const int rows = columns / 2;
  for (int row = 0; row <= rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const float down = glm::pi<float>() * static_cast<float>(row) / static_cast<float>(rows);
      const float around = glm::two_pi<float>() * static_cast<float>(column) / static_cast<float>(columns);
      mesh.position_m.push_back(radius_m * glm::vec3(std::sin(down) * std::sin(around), std::cos(down),
                                                     std::sin(down) * std::cos(around)));
    }
  const auto index = [&](int row, int column) {
    return static_cast<uint32_t>(row * columns + column % columns);
  };
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      mesh.triangle.emplace_back(index(row, column), index(row + 1, column), index(row + 1, column + 1));
      mesh.triangle.emplace_back(index(row, column), index(row + 1, column + 1), index(row, column + 1));
    }
  return mesh;
}

void drop_triangles(Mesh& mesh, const std::function<bool(const glm::vec3& middle_m)>& is_dropped) {
  std::vector<glm::uvec3> kept;
  for (const glm::uvec3& t : mesh.triangle) {
    const glm::vec3 middle = (mesh.position_m[t.x] + mesh.position_m[t.y] + mesh.position_m[t.z]) / 3.0f;
    if (!is_dropped(middle)) kept.push_back(t);
  }
  mesh.triangle = kept;
}

OccupancyRequest around(float reach_m, float cell_m) {
  OccupancyRequest request;
  request.low_m = glm::vec3(-reach_m);
  request.high_m = glm::vec3(reach_m);
  request.cell_m = cell_m;
  return request;
}

float distance_m(const HeadOccupancy& head, const glm::vec3& point_m) {
  return distance_at(head, (point_m - head.origin_m) / head.cell_m);
}

/// Share of the ball's inside that is solid, and of what surrounds it up to 1.5 radii.
std::pair<double, double> solid_shares(const HeadOccupancy& head) {
  int inside = 0, solid_inside = 0, outside = 0, solid_outside = 0;
  for (int z = 0; z < head.size.z; ++z)
    for (int y = 0; y < head.size.y; ++y)
      for (int x = 0; x < head.size.x; ++x) {
        const float radius_m = glm::length(head.origin_m + head.cell_m * glm::vec3(x, y, z));
        const bool is_solid =
            head.distance[(static_cast<size_t>(z) * head.size.y + y) * static_cast<size_t>(head.size.x) + x] <
            0;
        if (radius_m < kRadiusM - head.cell_m) {
          ++inside;
          solid_inside += is_solid;
        } else if (radius_m > kRadiusM + head.cell_m) {
          ++outside;
          solid_outside += is_solid;
        }
      }
  return {static_cast<double>(solid_inside) / inside, static_cast<double>(solid_outside) / outside};
}

TEST(HeadOccupancy, DistancesOfABallAreThoseOfItsSurface) {
  const HeadOccupancy head = make_head_occupancy(ball(kRadiusM), around(0.2f, 0.005f));
  ASSERT_FALSE(head.is_empty());
  const glm::vec3 way = glm::normalize(glm::vec3(0.3f, -0.5f, 0.8f));
  // A ball of 48 columns lies up to 0.3 mm inside of its corners; distances add up to an eighth too much from
  // cell to cell, and are stored to an eighth of a cell.
  for (const float radius_m : {0.085f, 0.095f, 0.1f, 0.103f})
    EXPECT_NEAR(distance_m(head, radius_m * way), radius_m - kRadiusM, 0.0012f) << radius_m;
  EXPECT_LT(distance_m(head, glm::vec3(0.0f)), -0.07f);
  EXPECT_EQ(solid_shares(head), std::make_pair(1.0, 0.0));
}

TEST(HeadOccupancy, HolesAndFacesTheWrongWayRoundDoNotMatter) {
  const auto shares = [](const Mesh& mesh) {
    return solid_shares(make_head_occupancy(mesh, around(0.2f, 0.005f)));
  };
  Mesh open = ball(kRadiusM);  // as a bust without a bottom
  drop_triangles(open, [](const glm::vec3& p) { return p.y < -0.09f; });
  EXPECT_GT(shares(open).first, 0.99);  // but for what lies below the cut: 0.7 %
  EXPECT_LT(shares(open).second, 0.001);

  Mesh eyes = ball(kRadiusM);
  drop_triangles(eyes, [](const glm::vec3& p) {
    return p.z > 0.0f && (glm::length(glm::vec2(p.x - 0.03f, p.y)) < 0.015f ||
                          glm::length(glm::vec2(p.x + 0.03f, p.y)) < 0.015f);
  });
  EXPECT_GT(shares(eyes).first, 0.99);
  EXPECT_LT(shares(eyes).second, 0.001);

  Mesh turned = ball(kRadiusM);
  for (glm::uvec3& t : turned.triangle) std::swap(t.y, t.z);
  EXPECT_EQ(shares(turned), std::make_pair(1.0, 0.0));

  Mesh mixed = ball(kRadiusM);
  for (size_t i = 0; i < mixed.triangle.size(); i += 3) std::swap(mixed.triangle[i].y, mixed.triangle[i].z);
  EXPECT_GT(shares(mixed).first, 0.99);
  EXPECT_LT(shares(mixed).second, 0.001);

  Mesh two_sided = ball(kRadiusM);
  const size_t count = two_sided.triangle.size();
  for (size_t i = 0; i < count; ++i) {
    const glm::uvec3 t = two_sided.triangle[i];
    two_sided.triangle.emplace_back(t.x, t.z, t.y);
  }
  EXPECT_EQ(shares(two_sided), std::make_pair(1.0, 0.0));

  // An eye within the head leaves it whole.
  Mesh nested = ball(kRadiusM);
  const Mesh eye = ball(0.03f, 24);
  const auto first = static_cast<uint32_t>(nested.position_m.size());
  nested.position_m.insert(nested.position_m.end(), eye.position_m.begin(), eye.position_m.end());
  for (const glm::uvec3& t : eye.triangle) nested.triangle.push_back(t + first);
  EXPECT_EQ(shares(nested), std::make_pair(1.0, 0.0));
}

TEST(HeadOccupancy, ACapIsNoHeadButTheBallUnderIt) {
  Mesh cap = ball(kRadiusM);
  drop_triangles(cap, [](const glm::vec3& p) { return p.y < 0.05f; });
  OccupancyRequest request = around(0.2f, 0.005f);
  request.ball = FittedSphere{glm::vec3(0.0f), kRadiusM};
  EXPECT_EQ(solid_shares(make_head_occupancy(cap, request)), std::make_pair(1.0, 0.0));
}

TEST(HeadOccupancy, NoMeshIsNothingAndABallIsEnough) {
  EXPECT_TRUE(make_head_occupancy(Mesh(), around(0.2f, 0.005f)).is_empty());
  OccupancyRequest request = around(0.2f, 0.005f);
  request.ball = FittedSphere{glm::vec3(0.0f), kRadiusM};
  EXPECT_EQ(solid_shares(make_head_occupancy(Mesh(), request)), std::make_pair(1.0, 0.0));
  EXPECT_TRUE(make_head_occupancy(SceneAsset(), std::nullopt).is_empty());
}

TEST(HeadOccupancy, TrianglesThatAreNoNumbersAreLeftOut) {
  Mesh mesh = ball(kRadiusM);
  mesh.position_m.emplace_back(std::numeric_limits<float>::quiet_NaN(), 0.0f, 0.0f);
  mesh.position_m.emplace_back(0.0f, 1e30f, 0.0f);
  const auto last = static_cast<uint32_t>(mesh.position_m.size() - 1);
  mesh.triangle.emplace_back(0, last, last - 1);
  mesh.triangle.emplace_back(last, last, last);
  mesh.triangle.emplace_back(7, 7, 7);
  EXPECT_EQ(solid_shares(make_head_occupancy(mesh, around(0.2f, 0.005f))), std::make_pair(1.0, 0.0));
}

TEST(HeadOccupancy, CellsAndWorkAreBounded) {
  const HeadOccupancy fine = make_head_occupancy(ball(kRadiusM), around(0.2f, 1e-4f));
  EXPECT_LE(fine.distance.size(), kMaxOccupancyCells);
  EXPECT_GT(fine.distance.size(), kMaxOccupancyCells / 2);
  EXPECT_EQ(solid_shares(fine), std::make_pair(1.0, 0.0));

  // Large triangles through all of it, each a little different: more work than a head is worth.
  Mesh hostile = ball(kRadiusM);
  for (uint32_t i = 0; i < 100'000; ++i) {
    const float a = 1e-5f * static_cast<float>(i);
    const auto first = static_cast<uint32_t>(hostile.position_m.size());
    hostile.position_m.emplace_back(-1.0f, -1.0f, a - 0.5f);
    hostile.position_m.emplace_back(1.0f, -1.0f, a);
    hostile.position_m.emplace_back(0.0f, 1.0f, 0.5f - a);
    hostile.triangle.emplace_back(first, first + 1, first + 2);
  }
  EXPECT_TRUE(make_head_occupancy(hostile, around(0.2f, 0.003f)).is_empty());
}

TEST(HeadOccupancy, TheBuiltInHeadIsSolidWhereItsFieldSaysSo) {
  SceneAsset asset;
  asset.head = make_head(kRadiusM);
  asset.strand_count = 2;
  asset.vertex_count = 2;
  asset.rest_position_m = {
      {-0.15f, -0.35f, -0.1f}, {0.15f, 0.1f, 0.1f}, {0.0f, 0.0f, 0.0f}, {0.1f, 0.0f, 0.0f}};
  const HeadOccupancy head = make_head_occupancy(asset, FittedSphere{glm::vec3(0.0f), kRadiusM});
  ASSERT_FALSE(head.is_empty());
  int wrong = 0, inside = 0;
  for (float z = -0.12f; z < 0.13f; z += 0.011f)
    for (float y = -0.3f; y < 0.11f; y += 0.011f)
      for (float x = -0.2f; x < 0.21f; x += 0.011f) {
        const float expected = head_distance(glm::vec3(x, y, z) / kRadiusM);
        if (std::abs(expected) < 0.1f) continue;  // within a cell or two of the skin
        inside += expected < 0.0f;
        wrong += (distance_m(head, {x, y, z}) < 0.0f) != (expected < 0.0f);
      }
  EXPECT_GT(inside, 2000);
  EXPECT_EQ(wrong, 0);
}

}  // namespace
}  // namespace strandcast::head_occupancy_test

// Laws of distance fields: exact distances of known shapes, signs that holes and flipped triangles do not
// change, the same bits for every order and number of threads, and what is refused.
#include "common/groom/distance_field.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <numbers>
#include <random>

#include "common/groom/winding_tree.h"
#include "tests/support/meshes.h"
#include "tests/support/own_workers.h"
#include "tests/support/shared_data.h"

namespace strandcast::distance_field_test {
namespace {

const std::filesystem::path kSintelCollider =
    std::filesystem::path(STRANDCAST_SHARED_DATA) / "meshes/sintel-collider.obj";

using testing::HasSubstr;

DistanceField field_of(const Mesh& mesh, uint32_t resolution) {
  auto field = make_distance_field(mesh, resolution);
  EXPECT_TRUE(field) << field.error().to_string();
  return field ? std::move(field).value() : DistanceField{};
}

std::string refusal(const Mesh& mesh, uint32_t resolution = 32) {
  const auto field = make_distance_field(mesh, resolution);
  return field ? "accepted" : field.error().message;
}

bool is_same(const DistanceField& a, const DistanceField& b) {
  return a.node_count == b.node_count && a.origin_m == b.origin_m && a.cell_m == b.cell_m &&
         std::memcmp(a.quad.data(), b.quad.data(), a.quad.size() * sizeof(glm::vec4)) == 0;
}

/// Every node with its distance.
template <class Work>
void for_nodes(const DistanceField& field, Work work) {
  for (uint32_t z = 0; z < field.node_count.z; ++z)
    for (uint32_t y = 0; y < field.node_count.y; ++y)
      for (uint32_t x = 0; x < field.node_count.x; ++x) {
        const size_t at = (size_t{z} * field.node_count.y + y) * field.node_count.x + x;
        work(glm::dvec3(field.origin_m) + static_cast<double>(field.cell_m) * glm::dvec3(x, y, z),
             field.quad[at].x);
      }
}

/// Points within `reach_m` of the surface, evenly over the triangles.
std::vector<glm::dvec3> points_near(const Mesh& mesh, double reach_m, size_t count) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<glm::dvec3> points;
  while (points.size() < count) {
    const glm::uvec3 corner = mesh.triangle[random() % mesh.triangle.size()];
    double u = unit(random), v = unit(random);
    if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
    const glm::dvec3 a = mesh.position_m[corner.x], b = mesh.position_m[corner.y],
                     c = mesh.position_m[corner.z];
    const glm::dvec3 away(unit(random) - 0.5, unit(random) - 0.5, unit(random) - 0.5);
    points.push_back(a + u * (b - a) + v * (c - a) + reach_m * 2.0 * away);
  }
  return points;
}

/// By brute force over all triangles, in double.
double exact_distance_m(const Mesh& mesh, const glm::dvec3& point) {
  double least = std::numeric_limits<double>::infinity(), winding = 0.0;
  for (const glm::uvec3& corner : mesh.triangle) {
    const glm::dvec3 a = glm::dvec3(mesh.position_m[corner.x]), b = glm::dvec3(mesh.position_m[corner.y]),
                     c = glm::dvec3(mesh.position_m[corner.z]);
    least = std::min(least, distance_to_triangle_m(point, a, b, c));
    const glm::dvec3 p = a - point, q = b - point, r = c - point;
    const double lp = glm::length(p), lq = glm::length(q), lr = glm::length(r);
    winding += std::atan2(glm::dot(p, glm::cross(q, r)),
                          lp * lq * lr + glm::dot(p, q) * lr + glm::dot(q, r) * lp + glm::dot(r, p) * lq);
  }
  return winding > std::numbers::pi ? -least : least;
}

TEST(TriangleDistance, IsThatOfTheNearestOfManyPoints) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const auto any = [&] { return glm::dvec3(unit(random), unit(random), unit(random)); };
  for (int trial = 0; trial < 200; ++trial) {
    const glm::dvec3 a = any(), b = any(), c = any(), point = 2.0 * any();
    double least = 1e9;
    constexpr int kSteps = 60;
    for (int i = 0; i <= kSteps; ++i)
      for (int j = 0; i + j <= kSteps; ++j)
        least = std::min(least, glm::distance(point, a + (b - a) * (i / 60.0) + (c - a) * (j / 60.0)));
    const double distance = distance_to_triangle_m(point, a, b, c);
    EXPECT_LE(distance, least + 1e-12);
    EXPECT_GE(distance, least - 0.03) << "no point of the triangle is so near";
  }
}

TEST(WindingTree, CountsAsTheSumOverAllTrianglesDoes) {
  const Mesh mesh = make_icosphere(1.0f, 3);
  std::vector<Triangle> triangles;
  for (size_t i = 0; i < mesh.triangle.size(); ++i)
    if (i % 9 != 0)  // holes: fractions between
      triangles.push_back({glm::dvec3(mesh.position_m[mesh.triangle[i].x]),
                           glm::dvec3(mesh.position_m[mesh.triangle[i].y]),
                           glm::dvec3(mesh.position_m[mesh.triangle[i].z])});
  const WindingTree tree(triangles);
  for (const glm::dvec3& point : points_near(mesh, 0.5, 300)) {
    double exact = 0.0;
    for (const Triangle& triangle : triangles) exact += WindingTree({triangle}).winding_number(point);
    EXPECT_NEAR(tree.winding_number(point), exact, 0.06) << glm::length(point);
  }
}

TEST(DistanceField, OfASphereIsExactToTheSquareOfACell) {
  constexpr double kRadiusM = 0.1;
  const Mesh mesh = make_icosphere(static_cast<float>(kRadiusM), 5);
  double before = 1.0;
  for (const uint32_t resolution : {16u, 32u, 64u}) {
    const DistanceField field = field_of(mesh, resolution);
    const double h = field.cell_m;
    double worst = 0.0, worst_slope = 0.0;
    for (const glm::dvec3& point : points_near(mesh, 0.5 * h, 2000)) {
      const DistanceField::Sample sample = field.sample(point);
      worst = std::max(worst, std::abs(sample.distance_m - (glm::length(point) - kRadiusM)));
      worst_slope = std::max(worst_slope, glm::distance(sample.gradient, glm::normalize(point)));
    }
    // Linear between nodes: h^2 / 8 times the curvature of the distance along each axis, 2 / r together; and
    // the icosphere's triangles lie up to 1 - cos 0.0235 radii below the sphere.
    constexpr double kChordM = 2.8e-4 * kRadiusM;
    EXPECT_LE(worst, h * h / 8.0 * 2.0 / (kRadiusM - h) + kChordM) << resolution;
    EXPECT_LE(worst_slope, 1.2 * h / kRadiusM) << resolution;
    EXPECT_LE(worst - kChordM, before / 2.5) << "of the second order";
    before = worst;
  }
}

TEST(DistanceField, OfABoxIsExactBesideItsEdges) {
  const glm::dvec3 half(0.1, 0.06, 0.08);
  const Mesh mesh = make_box(glm::vec3(half));
  const DistanceField field = field_of(mesh, 40);
  const auto exact = [&](const glm::dvec3& p) {
    const glm::dvec3 q = glm::abs(p) - half;
    return glm::length(glm::max(q, 0.0)) + std::min(std::max({q.x, q.y, q.z}), 0.0);
  };
  // Nodes are exact in the band; between them a kink costs as much as a cell is wide at worst.
  for_nodes(field, [&](const glm::dvec3& node, float distance) {
    if (std::abs(exact(node)) >= 2.0 * field.cell_m) return;
    EXPECT_NEAR(distance, exact(node), 1e-6);
  });
  for (const glm::dvec3& point : points_near(mesh, 0.005, 1000))
    EXPECT_NEAR(field.sample(point).distance_m, exact(point), 0.5 * field.cell_m);
}

TEST(DistanceField, HasTheRightSignEverywhereAndGrowsAwayFromTheSurface) {
  constexpr double kRadiusM = 0.1;
  const DistanceField field = field_of(make_icosphere(static_cast<float>(kRadiusM), 4), 48);
  for_nodes(field, [&](const glm::dvec3& node, float distance) {
    const double exact = glm::length(node) - kRadiusM;
    if (std::abs(exact) < 2e-4) return;  // the icosphere is no sphere
    ASSERT_EQ(distance < 0.0f, exact < 0.0) << glm::length(node);
    // First order beyond the band; the middle is a kink.
    ASSERT_NEAR(distance, exact, 1.5 * field.cell_m) << glm::length(node);
  });
  EXPECT_GT(field.sample({0.5, 0.0, 0.0}).distance_m, 0.003) << "beyond the grid it is outside";
}

TEST(DistanceField, FewMissingTrianglesCountAsClosed) {
  const Mesh whole = make_icosphere(0.1f, 3);
  Mesh torn = whole;
  for (size_t i = 0; i < 12; ++i) torn.triangle.erase(torn.triangle.begin() + 97 * (i + 1));
  const DistanceField closed = field_of(whole, 64), open = field_of(torn, 64);
  ASSERT_EQ(closed.quad.size(), open.quad.size());
  size_t wrong = 0, near = 0;
  double worst = 0.0;
  for (size_t i = 0; i < closed.quad.size(); ++i) {
    if (std::abs(closed.quad[i].x) > closed.cell_m) continue;
    ++near;
    wrong += (closed.quad[i].x < 0.0f) != (open.quad[i].x < 0.0f) ? 1 : 0;
    worst = std::max<double>(worst, std::abs(closed.quad[i].x - open.quad[i].x));
  }
  EXPECT_LT(static_cast<double>(wrong), 0.01 * static_cast<double>(near));
  EXPECT_LE(worst, 2.0 * closed.cell_m);
}

TEST(DistanceField, FewFlippedTrianglesAndThoseWithoutAreaChangeNoSign) {
  const Mesh whole = make_icosphere(0.1f, 3);
  Mesh rough = whole;
  for (size_t i = 0; i < 6; ++i) std::swap(rough.triangle[200 * i].x, rough.triangle[200 * i].y);
  for (uint32_t i = 0; i < 30; ++i) rough.triangle.emplace_back(i, i, i + 1);
  rough.triangle.emplace_back(3, 3, 3);
  const DistanceField straight = field_of(whole, 48), bent = field_of(rough, 48);
  size_t wrong = 0, near = 0;
  for (size_t i = 0; i < straight.quad.size(); ++i) {
    if (std::abs(straight.quad[i].x) > straight.cell_m) continue;
    ++near;
    wrong += (straight.quad[i].x < 0.0f) != (bent.quad[i].x < 0.0f) ? 1 : 0;
  }
  EXPECT_LT(static_cast<double>(wrong), 0.01 * static_cast<double>(near));
}

TEST(DistanceField, IsTheSameInsideOut) {
  const Mesh mesh = make_icosphere(0.1f, 3);
  Mesh turned = mesh;
  for (glm::uvec3& triangle : turned.triangle) std::swap(triangle.y, triangle.z);
  const DistanceField a = field_of(mesh, 32), b = field_of(turned, 32);
  for (size_t i = 0; i < a.quad.size(); ++i) ASSERT_LE(glm::distance(a.quad[i], b.quad[i]), 1e-7f);
}

TEST(DistanceField, OverlappingPartsCountAsOne) {
  Mesh two = make_icosphere(0.1f, 3);
  const Mesh other = two;
  const auto first = static_cast<uint32_t>(two.position_m.size());
  for (const glm::vec3& point : other.position_m)
    two.position_m.push_back(point + glm::vec3(0.08f, 0.0f, 0.0f));
  for (const glm::uvec3& triangle : other.triangle) two.triangle.push_back(triangle + first);
  const DistanceField field = field_of(two, 48);
  for_nodes(field, [&](const glm::dvec3& node, float distance) {
    const double exact = std::min(glm::length(node), glm::distance(node, glm::dvec3(0.08, 0.0, 0.0))) - 0.1;
    if (std::abs(exact) < 4e-4) return;
    ASSERT_EQ(distance < 0.0f, exact < 0.0);
  });
}

TEST(DistanceField, HasTheSameBitsForEveryOrderAndNumberOfThreads) {
  const Mesh mesh = make_head(0.095f);
  const DistanceField field = field_of(mesh, 32);
  Mesh shuffled = mesh;
  std::shuffle(shuffled.triangle.begin(), shuffled.triangle.end(), std::mt19937(5));
  EXPECT_TRUE(is_same(field, field_of(shuffled, 32)));
  for (const uint32_t threads : {1u, 3u})
    EXPECT_TRUE(is_same(field, make_distance_field(mesh, 32, *own_workers(threads)).value())) << threads;
}

TEST(DistanceField, RefusesWhatHasNoInside) {
  EXPECT_THAT(refusal({}), HasSubstr("no triangles with an area"));
  Mesh line = make_box(glm::vec3(0.1f, 0.0f, 0.0f));
  EXPECT_THAT(refusal(line), HasSubstr("no triangles with an area"));
  Mesh broken = make_icosphere(0.1f, 2);
  broken.position_m[7].y = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(refusal(broken), HasSubstr("no finite place"));
  Mesh missing = make_icosphere(0.1f, 2);
  missing.triangle[3].y = 100'000;
  EXPECT_THAT(refusal(missing), HasSubstr("a corner that is not there"));
  EXPECT_THAT(refusal(make_icosphere(0.1f, 2), 8), HasSubstr("16 to 128"));
  EXPECT_THAT(refusal(make_icosphere(0.1f, 2), 256), HasSubstr("16 to 128"));

  // A bowl is closed by a film, a flat dish has none.
  for (const float height : {0.1f, 0.05f}) {
    Mesh bowl = make_icosphere(0.1f, 3);
    std::erase_if(bowl.triangle, [&](const glm::uvec3& t) { return bowl.position_m[t.x].y > height - 0.1f; });
    EXPECT_THAT(refusal(bowl), HasSubstr(height > 0.05f ? "accepted" : "too open")) << height;
  }
  Mesh half_turned = make_icosphere(0.1f, 3);
  const Mesh other = make_icosphere(0.09f, 3);
  const auto first = static_cast<uint32_t>(half_turned.position_m.size());
  for (const glm::vec3& point : other.position_m)
    half_turned.position_m.push_back(point + glm::vec3(0.3f, 0.0f, 0.0f));
  for (const glm::uvec3& t : other.triangle)
    half_turned.triangle.emplace_back(first + t.x, first + t.z, first + t.y);
  EXPECT_THAT(refusal(half_turned), HasSubstr("inside out"));
}

TEST(DistanceField, OfTheSmallestAndTheLargestMeshIsNoLarger) {
  for (const float radius_m : {1e-6f, 1e6f}) {
    const DistanceField field = field_of(make_icosphere(radius_m, 1), kMaxFieldResolution);
    EXPECT_LE(field.quad.size() * sizeof(glm::vec4), kMaxFieldBytes) << radius_m;
    EXPECT_LT(field.sample(glm::dvec3(0.0)).distance_m, -0.7 * radius_m);
  }
}

TEST(DistanceField, OfTheBuiltInHeadIsThere) {
  const Mesh mesh = make_head(0.095f);
  const DistanceField field = field_of(mesh, 64);
  EXPECT_LE(field.quad.size() * sizeof(glm::vec4), kMaxFieldBytes);
  for (size_t i = 0; i < mesh.position_m.size(); i += 11)
    EXPECT_NEAR(field.sample(mesh.position_m[i]).distance_m, 0.0, 0.5 * field.cell_m);
}

/// Mean, 95 % and greatest error near the surface in mm and the share of wrong signs, of a measured
/// prototype.
struct MeasuredErrors {
  uint32_t resolution;
  double mean, most, wrong;
};

TEST(DistanceField, OfARealHeadIsAsGoodAsThePrototypes) {
  REQUIRE_SHARED(kSintelCollider);
  const auto mesh = load_obj(kSintelCollider, 1.0f);
  ASSERT_TRUE(mesh);
  const std::vector<glm::dvec3> points = points_near(*mesh, 0.005, 4000);
  std::vector<double> exact;
  for (const glm::dvec3& point : points) exact.push_back(exact_distance_m(*mesh, point));
  for (const MeasuredErrors& known :
       {MeasuredErrors{32, 0.32, 3.8, 0.030}, MeasuredErrors{64, 0.09, 1.7, 0.008},
        MeasuredErrors{128, 0.02, 0.75, 0.001}}) {
    const DistanceField field = field_of(*mesh, known.resolution);
    double sum = 0.0, most = 0.0, wrong = 0.0;
    for (size_t i = 0; i < points.size(); ++i) {
      const double distance = field.sample(points[i]).distance_m;
      const double error_mm = 1e3 * std::abs(distance - exact[i]);
      sum += error_mm;
      most = std::max(most, error_mm);
      wrong += (distance < 0.0) != (exact[i] < 0.0) ? 1.0 : 0.0;
    }
    const auto count = static_cast<double>(points.size());
    EXPECT_LE(sum / count, 1.1 * known.mean) << known.resolution;
    EXPECT_LE(most, 1.1 * known.most) << known.resolution;
    EXPECT_LE(wrong / count, known.wrong + 0.002) << known.resolution;
  }
}

}  // namespace
}  // namespace strandcast::distance_field_test

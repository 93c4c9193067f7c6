// Optical depths of the light lattice against what strands of known number and place give.
#include "common/render/light_lattice.h"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <random>

#include "common/groom/mesh.h"
#include "common/render/tiles/tile_frame.h"

namespace strandcast::light_lattice_test {
namespace {

// Of the lattice: a strand takes out 0.6 of the light that falls on its width, and is met at pi / 4 on
// average.
constexpr double kOpacity = 0.6;
constexpr double kCrossing = 0.785398;
constexpr float kWidthM = 2e-4f;

/// Horizontal strands of two points, spread evenly through a box of `side_m` about the origin.
StrandPoints strands_in_box(uint32_t count, float side_m, uint32_t seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> in(-0.5f * side_m, 0.5f * side_m);
  StrandPoints points;
  points.first_point.push_back(0);
  constexpr uint32_t kPoints = 17;
  for (uint32_t i = 0; i < count; ++i) {
    const float y = in(random);
    const float z = in(random);
    for (uint32_t k = 0; k < kPoints; ++k)
      points.point.push_back({side_m * (static_cast<float>(k) / (kPoints - 1) - 0.5f), y, z, 0, {}});
    points.first_point.push_back(static_cast<uint32_t>(points.point.size()));
    points.index.push_back(i);
  }
  return points;
}

/// Optical depth towards the key light at a point of the lattice's own axes: the nearest cell.
double key_depth(const LightLatticeView& view, const glm::vec3& point) {
  glm::ivec3 cell;
  for (int a = 0; a < 3; ++a)
    cell[a] = std::clamp(
        static_cast<int>(std::lround((glm::dot(point, view.axis[a]) - view.origin_m[a]) / view.cell_m)), 0,
        view.size[a] - 1);
  return view.key[(static_cast<size_t>(cell.z) * view.size.y + cell.y) * view.size.x + cell.x] *
         double{kLightDepthUnit};
}
double other_depth(const LightLatticeView& view, const glm::vec3& point, bool is_sky) {
  glm::ivec3 cell;
  for (int a = 0; a < 3; ++a)
    cell[a] = std::clamp(
        static_cast<int>(
            std::lround(((glm::dot(point, view.axis[a]) - view.origin_m[a]) / view.cell_m - 0.5f) * 0.5f)),
        0, view.half_size[a] - 1);
  const uint32_t both =
      view.others[(static_cast<size_t>(cell.z) * view.half_size.y + cell.y) * view.half_size.x + cell.x];
  return (is_sky ? both >> 16 : both & 0xffffu) * double{kLightDepthUnit};
}

/// Round the points.
void build(LightLattice& lattice, const StrandPoints& points, const LightStrands& strands,
           const LightDirections& lights, WorkerPool& workers) {
  std::vector<glm::vec3> place_m;
  for (const StrandPoint& p : points.point) place_m.emplace_back(p.x, p.y, p.z);
  lattice.build(fit_lattice(lattice.desc(), lights, place_m, 0.0f), points, strands, lights, workers);
}

class LightLatticeTest : public testing::Test {
 protected:
  static constexpr float kSideM = 0.1f;
  static constexpr uint32_t kCount = 20000;
  /// Length per volume x width x opacity x mean crossing: depth per metre.
  static constexpr double kPerM = kCount * 0.1 / (0.1 * 0.1 * 0.1) * kWidthM * kOpacity * kCrossing;
  WorkerPool workers_{2};
};

/// Depth of the sky where its ways have these depths.
double mean_of_sky(const glm::vec3& up, const std::function<double(const glm::vec3&)>& depth) {
  double open = 0.0;
  for (const glm::vec3& way : sky_ways(up)) open += std::exp(-kSkyReach * depth(way)) / kSkyWays;
  return -std::log(open) / kSkyReach;
}

TEST_F(LightLatticeTest, DepthGrowsAsTheHairThatIsPassed) {
  // From a point within the box to its side.
  const auto way_out = [](const glm::vec3& from, const glm::vec3& way) {
    double out_m = 1.0;
    for (int a = 0; a < 3; ++a)
      if (way[a] != 0.0f)
        out_m = std::min(out_m, (std::copysign(0.5 * kSideM, double{way[a]}) - from[a]) / way[a]);
    return out_m;
  };
  const StrandPoints points = strands_in_box(kCount, kSideM);
  LightLattice lattice({kSideM, 32, false, {}, nullptr});
  build(lattice, points, {kWidthM, 1.0f, 0.0f}, {{0, 1, 0}, {0, 0, 1}, {0, 1, 0}, true}, workers_);
  for (const float y : {0.03f, 0.0f, -0.03f}) {
    const double passed_m = 0.5 * kSideM - y;
    EXPECT_NEAR(key_depth(lattice.view(), {0, y, 0}), kPerM * passed_m, 0.04 * kPerM * kSideM) << y;
    const double open = mean_of_sky({0, 1, 0}, [&](const glm::vec3& way) {
      return kPerM * way_out({0, y, 0}, way);
    });
    EXPECT_NEAR(other_depth(lattice.view(), {0, y, 0}, true), open, 0.06 * kPerM * kSideM) << y;
  }
  for (const float z : {0.03f, -0.03f})
    EXPECT_NEAR(other_depth(lattice.view(), {0, 0, z}, false), kPerM * (0.5 * kSideM - z),
                0.06 * kPerM * kSideM)
        << z;
}

// A dense roof takes the light of the one way that it stands in, where a sky of one way would be dark.
TEST_F(LightLatticeTest, TheSkyIsAllAround) {
  constexpr float kRoofM = 0.02f;
  StrandPoints points = strands_in_box(20000, kRoofM);
  for (StrandPoint& p : points.point) p.y += 0.05f;
  LightLattice lattice({kSideM, 64, true, FittedSphere{glm::vec3(0.0f), 0.06f}, nullptr});
  build(lattice, points, {kWidthM, 1.0f, 0.0f}, {{0, 1, 0}, {0, 0, 1}, {0, 1, 0}, false}, workers_);
  const double alone = key_depth(lattice.view(), {0, -0.03f, 0});
  EXPECT_GT(alone, 10.0);
  const double expected =
      mean_of_sky({0, 1, 0}, [&](const glm::vec3& way) { return way.y > 0.99f ? alone : 0.0; });
  EXPECT_NEAR(other_depth(lattice.view(), {0, -0.03f, 0}, true), expected, 0.1);
}

TEST_F(LightLatticeTest, NothingIsShadowedInFrontOfTheHair) {
  const StrandPoints points = strands_in_box(2000, kSideM);
  LightLattice lattice({kSideM, 32, false, {}, nullptr});
  build(lattice, points, {kWidthM, 1.0f, 0.0f}, {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}, false}, workers_);
  EXPECT_NEAR(key_depth(lattice.view(), {0, 0, 0.06f}), 0.0, 0.02);
  EXPECT_EQ(other_depth(lattice.view(), {0, 0, 0}, false), 0.0) << "there is no rim light";
}

TEST_F(LightLatticeTest, OrderAndThreadsDoNotShow) {
  StrandPoints points = strands_in_box(3000, kSideM);
  LightLattice one({kSideM, 48, false, {}, nullptr});
  WorkerPool alone(1);
  const LightDirections lights{
      glm::normalize(glm::vec3(0.3f, 1, 0.2f)), glm::normalize(glm::vec3(-1, 0.3f, 0.5f)), {0, 1, 0}, true};
  build(one, points, {kWidthM, 0.3f, 0.2f}, lights, alone);
  const glm::ivec3 size = one.view().size;
  const std::vector<uint16_t> key(one.view().key, one.view().key + size_t{1} * size.x * size.y * size.z);
  // Strands in another order, on more threads.
  StrandPoints turned;
  turned.first_point.push_back(0);
  for (uint32_t strand = points.strand_count(); strand-- > 0;) {
    for (uint32_t i = points.first_point[strand]; i < points.first_point[strand + 1]; ++i)
      turned.point.push_back(points.point[i]);
    turned.first_point.push_back(static_cast<uint32_t>(turned.point.size()));
    turned.index.push_back(points.index[strand]);
  }
  WorkerPool many(4);
  LightLattice other({kSideM, 48, false, {}, nullptr});
  build(other, turned, {kWidthM, 0.3f, 0.2f}, lights, many);
  ASSERT_EQ(other.view().size, size);
  EXPECT_TRUE(std::equal(key.begin(), key.end(), other.view().key));
}

/// The built-in head of this radius, in a lattice of 64 cells along 0.2 m, or of others.
LightLatticeDesc with_head(float radius_m, uint32_t cells = 64) {
  OccupancyRequest request;
  request.ball = FittedSphere{glm::vec3(0.0f), radius_m};
  return {0.2f, cells, true, *request.ball,
          std::make_shared<const HeadOccupancy>(make_head_occupancy(make_head(radius_m), request))};
}

TEST_F(LightLatticeTest, AHeadIsOpaqueAndBesideItNothingIs) {
  constexpr float kRadiusM = 0.08f;
  OccupancyRequest request;
  request.ball = FittedSphere{glm::vec3(0.0f), kRadiusM};
  LightLattice lattice({0.2f, 64, true, *request.ball,
                        std::make_shared<const HeadOccupancy>(make_head_occupancy(Mesh(), request))});
  const StrandPoints points = strands_in_box(10, 0.2f);
  for (const glm::vec3 to_light :
       {glm::vec3(0, 1, 0), glm::vec3(0.6f, 0, -0.8f), glm::normalize(glm::vec3(0.3f, 1, 0.2f))}) {
    const glm::vec3 aside = glm::normalize(glm::cross(to_light, glm::vec3(0.3f, 0.1f, 1)));
    build(lattice, points, {kWidthM, 1.0f, 0.0f}, {to_light, aside, {0, 1, 0}, true}, workers_);
    EXPECT_NEAR(key_depth(lattice.view(), -1.1f * kRadiusM * to_light), kSolidDepth, 0.5);
    EXPECT_LT(key_depth(lattice.view(), 1.1f * kRadiusM * to_light), 0.5);
    EXPECT_LT(key_depth(lattice.view(), kRadiusM * (1.15f * aside - 1.1f * to_light)), 0.5);
    // The surface that counts lies a little below its skin.
    const float seen_m = kRadiusM - kSolidInset * lattice.view().soft_m;
    const float room_m = (kSolidFarRamp + 1.0f) * lattice.view().soft_m;
    EXPECT_LT(key_depth(lattice.view(), (seen_m + room_m) * aside - 1.1f * kRadiusM * to_light), 0.1);
    EXPECT_GT(key_depth(lattice.view(), (seen_m - room_m) * aside - 1.1f * kRadiusM * to_light),
              0.9 * kSolidDepth);
    EXPECT_GT(other_depth(lattice.view(), -1.1f * kRadiusM * aside, false), 20.0);
  }
  // From straight above it hides a part of the sky, that goes with what lies above.
  build(lattice, points, {kWidthM, 1.0f, 0.0f}, {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}, false}, workers_);
  // Its surface lies up to a cell deeper there.
  const glm::vec3 below(0, -1.2f * kRadiusM, 0);
  const auto behind_ball = [&](double ball_m) {
    return mean_of_sky({0, 1, 0}, [&](const glm::vec3& way) {
      const double nearest_m = glm::length(below - glm::dot(below, way) * way);
      const double chord_m = 2.0 * std::sqrt(std::max(ball_m * ball_m - nearest_m * nearest_m, 0.0));
      return kSolidSkyDepth * chord_m / lattice.view().soft_m;
    });
  };
  const double seen_m = kRadiusM - kSolidInset * lattice.view().soft_m;
  EXPECT_LT(other_depth(lattice.view(), below, true), behind_ball(seen_m) + 0.05);
  EXPECT_GT(other_depth(lattice.view(), below, true), behind_ball(seen_m - lattice.view().cell_m) - 0.05);
}

/// Does the mesh stand between a point and a light? Moeller and Trumbore 1997.
bool is_hidden(const Mesh& mesh, const glm::vec3& from, const glm::vec3& to_light) {
  for (const glm::uvec3& corner : mesh.triangle) {
    const glm::vec3 a = mesh.position_m[corner.x];
    const glm::vec3 u = mesh.position_m[corner.y] - a;
    const glm::vec3 v = mesh.position_m[corner.z] - a;
    const glm::vec3 across = glm::cross(to_light, v);
    const float scale = glm::dot(u, across);
    if (std::abs(scale) < 1e-12f) continue;
    const float part_u = glm::dot(from - a, across) / scale;
    const glm::vec3 turned = glm::cross(from - a, u);
    const float part_v = glm::dot(to_light, turned) / scale;
    if (part_u < 0.0f || part_v < 0.0f || part_u + part_v > 1.0f) continue;
    if (glm::dot(v, turned) / scale > 0.0f) return true;
  }
  return false;
}

/// Optical depth towards the key light, interpolated as pictures do it.
double smooth_key_depth(const LightLatticeView& view, const glm::vec3& point) {
  const glm::vec3 cell = (glm::vec3(glm::dot(point, view.axis[0]), glm::dot(point, view.axis[1]),
                                    glm::dot(point, view.axis[2])) -
                          view.origin_m) /
                         view.cell_m;
  double depth = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::vec3 step(corner & 1, (corner >> 1) & 1, corner >> 2);
    const glm::vec3 at = glm::floor(cell) + step;
    const glm::vec3 weight = 1.0f - glm::abs(cell - at);
    depth += double{weight.x} * weight.y * weight.z *
             key_depth(view, view.axis[0] * (view.origin_m.x + view.cell_m * at.x) +
                                 view.axis[1] * (view.origin_m.y + view.cell_m * at.y) +
                                 view.axis[2] * (view.origin_m.z + view.cell_m * at.z));
  }
  return depth;
}

// What lies behind the head's edge is lit alike all along it: the shadow's edge shows no cells.
TEST_F(LightLatticeTest, TheEdgeOfTheHeadsShadowShowsNoCells) {
  constexpr float kRadiusM = 0.08f;
  OccupancyRequest request;
  request.ball = FittedSphere{glm::vec3(0.0f), kRadiusM};
  LightLattice lattice({0.45f, kLightCells, true, *request.ball,
                        std::make_shared<const HeadOccupancy>(make_head_occupancy(Mesh(), request))});
  const glm::vec3 to_light = glm::normalize(glm::vec3(0.3f, 1, 0.2f));
  build(lattice, strands_in_box(10, 0.25f), {kWidthM, 1.0f, 0.0f}, {to_light, {0, 1, 0}, {0, 1, 0}, false},
        workers_);
  const glm::vec3 aside = glm::normalize(glm::cross(to_light, glm::vec3(0.3f, 0.1f, 1)));
  const glm::vec3 across = glm::cross(to_light, aside);
  // Mean light on a circle around the shadow's axis, and how much it differs along it.
  const auto light_at = [&](float radius_m) {
    constexpr int kPlaces = 720;
    double sum = 0.0;
    double squares = 0.0;
    for (int i = 0; i < kPlaces; ++i) {
      const float angle = 6.2831853f * static_cast<float>(i) / kPlaces;
      const glm::vec3 place =
          radius_m * (std::cos(angle) * aside + std::sin(angle) * across) - kRadiusM * to_light;
      const double light = std::exp(-smooth_key_depth(lattice.view(), place));
      sum += light / kPlaces;
      squares += light * light / kPlaces;
    }
    return std::pair(sum, std::sqrt(std::max(squares - sum * sum, 0.0)));
  };
  float dark_m = 0.9f * kRadiusM;
  float lit_m = 1.1f * kRadiusM;
  ASSERT_LT(light_at(dark_m).first, 0.1);
  ASSERT_GT(light_at(lit_m).first, 0.9);
  for (int i = 0; i < 20; ++i) {
    const float middle_m = 0.5f * (dark_m + lit_m);
    (light_at(middle_m).first < 0.5 ? dark_m : lit_m) = middle_m;
  }
  EXPECT_LT(light_at(dark_m).second, 0.06);
  // The edge lies where the head's is, within half a cell.
  EXPECT_NEAR(dark_m, kRadiusM, 0.5f * lattice.view().soft_m);
}

/// Skin of a face that a light shines at: how much of it the head hides from the light even this far above
/// the skin, how much it does not hide, and how much of both the lattice says is dark.
struct OwnShade {
  int hidden = 0, hidden_and_dark = 0, open = 0, open_and_dark = 0;
};
void add_own_shade(const Mesh& head, const LightLatticeView& view, const glm::vec3& to_light, float lift_m,
                   OwnShade& shade) {
  constexpr float kHiddenM = 0.004f;
  constexpr float kClearM = 1e-4f;
  constexpr float kFacing = 0.2f;
  constexpr double kDark = 0.7;  // half of the light
  constexpr size_t kEvery = 5;
  for (size_t i = 0; i < head.position_m.size(); i += kEvery) {
    const glm::vec3& p = head.position_m[i];
    const glm::vec3& normal = head.normal[i];
    if (p.z < 0.0f || p.y < -0.12f || glm::dot(normal, to_light) < kFacing) continue;
    const bool is_dark = smooth_key_depth(view, p + lift_m * normal) > kDark;
    if (is_hidden(head, p + kHiddenM * normal, to_light)) {
      ++shade.hidden;
      shade.hidden_and_dark += is_dark ? 1 : 0;
    } else if (!is_hidden(head, p + kClearM * normal, to_light)) {
      ++shade.open;
      shade.open_and_dark += is_dark ? 1 : 0;
    }
  }
}

// Brow, nose and chin shade the face, and lit skin stays clean, in cells as large as the built-in scene's.
TEST_F(LightLatticeTest, TheFaceCastsItsShadowOnItself) {
  constexpr float kHeadM = 0.095f;
  const Mesh head = make_head(kHeadM);
  OccupancyRequest request;
  request.ball = FittedSphere{glm::vec3(0.0f), kHeadM};
  LightLattice lattice({0.45f, kLightCells, true, *request.ball,
                        std::make_shared<const HeadOccupancy>(make_head_occupancy(head, request))});
  OwnShade skin, above;
  for (const glm::vec3 way :
       {glm::vec3(0.45f, 0.75f, 0.5f), glm::vec3(-0.8f, 0.3f, 0.4f), glm::vec3(0.2f, 1, 0.6f)}) {
    const glm::vec3 to_light = glm::normalize(way);
    build(lattice, strands_in_box(10, 0.25f), {kWidthM, 1.0f, 0.0f}, {to_light, {0, 1, 0}, {0, 1, 0}, false},
          workers_);
    const float lift_m = kSkinLift * lattice.view().soft_m;
    add_own_shade(head, lattice.view(), to_light, lift_m, skin);
    add_own_shade(head, lattice.view(), to_light, lift_m + 0.006f, above);
  }
  ASSERT_GT(skin.hidden, 20);
  EXPECT_GT(skin.hidden_and_dark, 0.65 * skin.hidden);
  EXPECT_LT(skin.open_and_dark, 0.01 * skin.open);
  EXPECT_LT(above.hidden_and_dark, 0.35 * skin.hidden) << "looked up 6 mm further out";
}

/// Whether nothing is seen of what lies around a point.
bool is_hidden(const LightLatticeView& view, const glm::vec3& point) {
  glm::ivec3 cell;
  for (int a = 0; a < 3; ++a) {
    const float at = ((glm::dot(point, view.axis[a]) - view.origin_m[a]) / view.cell_m - 0.5f) * 0.5f;
    cell[a] = std::clamp(static_cast<int>(at), 0, view.half_size[a] - 2);
  }
  return view.hidden[(static_cast<size_t>(cell.z) * view.half_size.y + cell.y) * view.half_size.x + cell.x] !=
         0;
}

// Straight rays from the eye past a ball, as geometry has them: no place that such a ray reaches is hidden.
TEST_F(LightLatticeTest, AHeadHidesWhatLiesBehindItAndNothingElse) {
  constexpr float kRadiusM = 0.08f;
  LightLattice lattice(with_head(kRadiusM, kLightCells));
  const LightDirections lights{
      glm::normalize(glm::vec3(0.3f, 1, 0.2f)), glm::normalize(glm::vec3(-1, 0.3f, 0.5f)), {0, 1, 0}, true};
  build(lattice, strands_in_box(10, 0.25f), {kWidthM, 1.0f, 0.0f}, lights, workers_);
  EXPECT_EQ(lattice.view().hidden, nullptr) << "nobody looks";
  std::mt19937 random(3);
  std::uniform_real_distribution<float> in(-0.12f, 0.12f);
  for (const glm::vec3 eye : {glm::vec3(0, 0.02f, 0.5f), glm::vec3(0.5f, 0.3f, 0), glm::vec3(-1.5f, 1, -2)}) {
    lattice.hide_from(eye);
    ASSERT_NE(lattice.view().hidden, nullptr);
    int hidden = 0, behind = 0, wrong = 0;
    for (int i = 0; i < 20'000; ++i) {
      const glm::vec3 point(in(random), in(random), in(random));
      // Above the neck and the jaw the head is all that there is.
      if (point.y < 0.0f) continue;
      const glm::vec3 way = eye - point;
      const float part = std::clamp(-glm::dot(point, way) / glm::dot(way, way), 0.0f, 1.0f);
      const bool is_behind = glm::length(point + part * way) < 0.8f * kRadiusM;
      const bool is_seen = glm::length(point + part * way) > 1.5f * kRadiusM;
      const bool is_in_dark = is_hidden(lattice.view(), point);
      behind += is_behind && part > 0.0f && glm::length(point) > kRadiusM;
      hidden += is_behind && part > 0.0f && glm::length(point) > kRadiusM && is_in_dark;
      wrong += is_seen && is_in_dark;
    }
    EXPECT_GT(behind, 100);
    EXPECT_GT(hidden, 0.1 * behind);
    EXPECT_EQ(wrong, 0);
  }
  lattice.hide_from({0.0f, 0.1f, 0.0f});
  EXPECT_EQ(lattice.view().hidden, nullptr) << "an eye among the hair";
  lattice.hide_from(glm::vec3(std::nanf("")));
  EXPECT_EQ(lattice.view().hidden, nullptr) << "an eye that is nowhere";
}

// Hair hides as deep as it is dense.
TEST_F(LightLatticeTest, DenseHairHidesAndThinHairDoesNot) {
  for (const float width_m : {0.1f * kWidthM, kWidthM}) {
    LightLattice lattice({kSideM, 32, false, {}, nullptr});
    build(lattice, strands_in_box(kCount, kSideM), {width_m, 1.0f, 0.0f},
          {{0, 1, 0}, {0, 0, 1}, {0, 1, 0}, true}, workers_);
    lattice.hide_from({0.0f, 0.0f, 0.6f});
    ASSERT_NE(lattice.view().hidden, nullptr);
    EXPECT_FALSE(is_hidden(lattice.view(), {0, 0, 0.045f})) << "the side of the eye";
    EXPECT_EQ(is_hidden(lattice.view(), {0, 0, -0.035f}), width_m * kPerM / kWidthM * 0.08 > 6.0);
  }
}

TEST_F(LightLatticeTest, ShouldersLieInTheShadeOfTheHead) {
  constexpr float kRadiusM = 0.08f;
  LightLattice lattice(with_head(kRadiusM));
  // Hair down to the shoulders, so that the lattice reaches them.
  const StrandPoints points = strands_in_box(10, 0.4f);
  const LightDirections lights{{0, 1, 0}, {0, 0, 1}, {0, 1, 0}, true};
  build(lattice, points, {kWidthM, 1.0f, 0.0f}, lights, workers_);
  // Beside the neck, under jaw and ear; and out on the shoulder.
  EXPECT_GT(key_depth(lattice.view(), {0.055f, -0.15f, 0.0f}), 10.0);
  EXPECT_LT(key_depth(lattice.view(), {0.13f, -0.15f, 0.0f}), 0.5);
  // The neck lies in the shade of the chin, the chest in front of it does not.
  EXPECT_GT(key_depth(lattice.view(), {0.0f, -0.13f, 0.05f}), 10.0);
  EXPECT_LT(key_depth(lattice.view(), {0.0f, -0.13f, 0.13f}), 0.5);
}

// Of a body that is larger than the hair's lattice only what lies within it casts shadows.
TEST_F(LightLatticeTest, ABodyBeyondTheLatticeIsNotInItsOwnShade) {
  OccupancyRequest request;
  request.ball = FittedSphere{glm::vec3(0.0f), 0.2f};
  LightLattice lattice(
      {0.1f, 32, false, {}, std::make_shared<const HeadOccupancy>(make_head_occupancy(Mesh(), request))});
  for (const glm::vec3 to_light : {glm::vec3(0, 1, 0), glm::vec3(0, 0, 1), glm::vec3(-1, 0, 0)}) {
    const glm::vec3 aside(to_light.z, to_light.x, to_light.y);
    build(lattice, strands_in_box(100, 0.1f), {kWidthM, 1.0f, 0.0f}, {to_light, aside, to_light, true},
          workers_);
    for (const glm::vec3 way : {to_light, aside, -aside})
      EXPECT_LT(key_depth(lattice.view(), 0.2f * way), 0.5);
    EXPECT_LT(other_depth(lattice.view(), 0.2f * aside, false), 0.5);
    EXPECT_NEAR(key_depth(lattice.view(), -0.2f * to_light), kSolidDepth, 1.0);
  }
}

TEST_F(LightLatticeTest, TheHeadIsTheSameForAnyNumberOfThreads) {
  const StrandPoints points = strands_in_box(500, 0.2f);
  const LightDirections lights{
      glm::normalize(glm::vec3(0.3f, 1, 0.2f)), glm::normalize(glm::vec3(-1, 0.3f, 0.5f)), {0, 1, 0}, true};
  LightLattice one(with_head(0.08f));
  WorkerPool alone(1);
  build(one, points, {kWidthM, 1.0f, 0.0f}, lights, alone);
  const auto count = [](const glm::ivec3& size) { return size_t{1} * size.x * size.y * size.z; };
  for (const uint32_t threads : {2u, 3u, 5u}) {
    LightLattice other(with_head(0.08f));
    WorkerPool many(threads);
    build(other, points, {kWidthM, 1.0f, 0.0f}, lights, many);
    EXPECT_TRUE(std::equal(one.view().key, one.view().key + count(one.view().size), other.view().key));
    EXPECT_TRUE(
        std::equal(one.view().others, one.view().others + count(one.view().half_size), other.view().others));
  }
}

// Rows are filled in strides where the skin is far: every cell as if looked up alone.
TEST_F(LightLatticeTest, NoCellOfTheHeadIsSkipped) {
  const LightLatticeDesc desc = with_head(0.08f, 96);
  LightLattice lattice(desc);
  StrandPoints none = strands_in_box(2, 0.4f);
  const LightDirections lights{glm::normalize(glm::vec3(0.3f, 0.8f, 0.5f)), {0, 0, 1}, {0, 1, 0}, false};
  build(lattice, none, {0.0f, 1.0f, 0.0f}, lights, workers_);
  const LightLatticeView& view = lattice.view();
  double worst = 0.0;
  for (int y = 0; y < view.size.y; ++y)
    for (int x = 0; x < view.size.x; ++x) {
      double most = 0.0;
      std::vector<double> below(static_cast<size_t>(view.size.z), -100.0);
      for (int z = 0; z < view.size.z; ++z) {
        const glm::vec3 along = view.origin_m + view.cell_m * glm::vec3(x, y, z);
        const glm::vec3 place = (along.x * view.axis[0] + along.y * view.axis[1] + along.z * view.axis[2] -
                                 desc.solid->origin_m) /
                                desc.solid->cell_m;
        const glm::ivec3 at(x, y, z);
        const bool is_there = glm::all(glm::greaterThanEqual(at, glm::ivec3(kSolidBorderCells))) &&
                              glm::all(glm::lessThan(at, view.size - kSolidBorderCells)) &&
                              glm::all(glm::greaterThan(place, glm::vec3(-0.5f))) &&
                              glm::all(glm::lessThan(place, glm::vec3(desc.solid->size) - 0.5f));
        if (is_there) below[static_cast<size_t>(z)] = -distance_at(*desc.solid, place) / view.soft_m;
        const auto share = [](double depth, double inset, double ramp) {
          return std::clamp(0.5 + (depth - inset) * 0.5 / ramp, 0.0, 1.0);
        };
        most = std::max(most, share(below[static_cast<size_t>(z)], kSolidInset, kSolidRamp));
        const int far = z - static_cast<int>(kSolidFar);  // cells are as large as soft_m
        if (far >= 0)
          most = std::max(most, share(below[static_cast<size_t>(far)], kSolidFarInset, kSolidFarRamp));
        const double depth = kSolidDepth * most * most * most;
        const size_t cell = (static_cast<size_t>(z) * view.size.y + y) * static_cast<size_t>(view.size.x) + x;
        worst = std::max(worst, std::abs(view.key[cell] * double{kLightDepthUnit} - depth));
      }
    }
  EXPECT_LT(worst, 0.005);
}

TEST_F(LightLatticeTest, StrandsThatAreNoNumbersCastNothing) {
  StrandPoints points = strands_in_box(100, kSideM);
  points.point[5].x = std::numeric_limits<float>::quiet_NaN();
  points.point[40].y = 1e30f;
  LightLattice lattice({kSideM, 32, false, {}, nullptr});
  build(lattice, points, {kWidthM, 1.0f, 0.0f}, {{0, 1, 0}, {0, 0, 1}, {0, 1, 0}, true}, workers_);
  EXPECT_LE(lattice.view().size.x, 160);
  EXPECT_LT(key_depth(lattice.view(), {0, 0.04f, 0}), 1.0);
}

}  // namespace
}  // namespace strandcast::light_lattice_test

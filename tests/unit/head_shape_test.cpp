// The head under a groom: what is drawn is what collides, and neither swallows the hair as loaded. Where the
// face is, which way is up and how long a unit is are found again however the hair was turned and scaled.
#include "common/groom/head_shape.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "common/groom/groom_file.h"
#include "common/groom/head_fit.h"
#include "common/groom/head_measure.h"
#include "common/groom/head_spheres.h"
#include "common/groom/procedural.h"
#include "common/math/point_tree.h"
#include "tests/support/groom_files.h"

namespace strandcast::head_shape_test {
namespace {

constexpr float kRadiusM = 0.09f;

/// Hair on all of a scalp, which leaves the face at +Z free.
Groom full_head(uint32_t strand_count = 600) {
  ProceduralGroomOptions options;
  options.strand_count = strand_count;
  options.vertex_count = 8;
  options.length_m = 0.15f;
  return grow_groom(make_scalp_cap(glm::vec3(0.0f), kRadiusM, 500), options).value();
}

Groom moved(Groom groom, const std::function<glm::vec3(const glm::vec3&)>& move) {
  for (glm::vec3& point : groom.rest_position_m) point = move(point);
  return groom;
}

/// The strands whose root passes.
Groom picked(const Groom& groom, const std::function<bool(const glm::vec3&)>& is_wanted) {
  Groom some;
  some.offset = {0};
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand) {
    if (!is_wanted(groom.rest_position_m[groom.offset[strand]])) continue;
    for (uint32_t i = groom.offset[strand]; i < groom.offset[strand + 1]; ++i) {
      some.rest_position_m.push_back(groom.rest_position_m[i]);
      some.pinned.push_back(groom.pinned[i]);
    }
    some.offset.push_back(static_cast<uint32_t>(some.rest_position_m.size()));
  }
  return some;
}

struct FittedHead {
  Mesh mesh;
  std::vector<FittedSphere> spheres;
  HeadMeasure measure;
};

FittedHead head_under(const Groom& groom) {
  FittedHead head;
  head.mesh = HeadShape(groom, fit_head(groom), HeadFit::Whole).mesh();
  head.spheres = shrink_under(fit_spheres(head.mesh, kHeadSpheres, groom), groom);
  head.measure = measure_head(head.mesh, head.spheres, groom);
  return head;
}

void expect_head(const FittedHead& head, const std::string& name) {
  ASSERT_FALSE(head.mesh.position_m.empty()) << name;
  for (const glm::vec3& point : head.mesh.position_m)
    ASSERT_TRUE(glm::length(point) < 10.0f) << name << ": not finite or nowhere near a head";
  EXPECT_FALSE(head.spheres.empty()) << name;
  EXPECT_LE(head.spheres.size(), kHeadSpheres) << name;
  EXPECT_LE(head.measure.deepest_vertex_m, 1.001 * static_cast<double>(kSwallowedM)) << name;
}

TEST(HeadShape, FullHeadsOfAnyShapeStandOnTheSkin) {
  const std::vector<glm::vec3> shapes = {
      {1.0f, 1.0f, 1.0f}, {0.85f, 1.0f, 1.1f}, {0.9f, 1.12f, 1.0f}, {1.1f, 0.95f, 1.2f}};
  for (const glm::vec3& shape : shapes) {
    const std::string name = fmt::format("stretched by {} {} {}", shape.x, shape.y, shape.z);
    const Groom groom =
        moved(full_head(), [&](const glm::vec3& p) { return shape * p + glm::vec3(0, 1.5f, 0); });
    const FittedHead head = head_under(groom);
    expect_head(head, name);
    EXPECT_LT(head.measure.root_median_m, 0.0015) << name;
    EXPECT_LT(head.measure.root_most_m, 0.004) << name;
    EXPECT_LT(head.measure.sphere_median_m, 0.003) << name;
    EXPECT_LT(head.measure.sphere_most_m, 0.009) << name;
  }
}

// A sphere with a dent of 8 mm at the side: skin follows its roots, and no sphere bridges it.
TEST(HeadShape, SkinFollowsADent) {
  const Groom groom = moved(full_head(), [](const glm::vec3& p) {
    const glm::vec3 side = p - glm::vec3(kRadiusM, 0.02f, -0.02f);
    const float depth_m = 0.008f * std::exp(-glm::dot(side, side) / (2.0f * 0.03f * 0.03f));
    return p - glm::vec3(depth_m, 0.0f, 0.0f);
  });
  const FittedHead head = head_under(groom);
  expect_head(head, "dented");
  EXPECT_LT(head.measure.root_most_m, 0.004);
}

TEST(HeadShape, GroomsThatShowLittleOfTheHeadGetOneAllTheSame) {
  const Groom full = full_head();
  expect_head(head_under(picked(full, [](const glm::vec3& p) { return std::abs(p.x) < 0.01f; })), "mohawk");
  expect_head(head_under(picked(full, [](const glm::vec3& p) { return p.x > 0.06f && p.y > 0.0f; })), "tuft");
  expect_head(head_under(picked(full, [](const glm::vec3& p) { return p.y < -0.03f; })), "nape");
  Groom beard = picked(full, [](const glm::vec3& p) { return p.z > 0.05f; });
  expect_head(head_under(moved(beard, [](const glm::vec3& p) { return glm::vec3(p.x, -p.y, p.z); })),
              "beard");
}

TEST(HeadShape, DegenerateGroomsGetAHead) {
  const auto of = [](const std::vector<glm::vec3>& points, uint32_t vertices) {
    Groom groom;
    groom.rest_position_m = points;
    for (uint32_t i = 0; i <= points.size(); i += vertices) groom.offset.push_back(i);
    groom.pinned.assign(points.size(), 0);
    return groom;
  };
  expect_head(head_under(of({{0, 0, 0}, {0, 0.1f, 0}}, 2)), "one strand");
  expect_head(head_under(of(std::vector<glm::vec3>(80, glm::vec3(0.1f)), 2)), "all in one point");
  std::vector<glm::vec3> line, plane;
  for (int i = 0; i < 100; ++i) {
    const float x = 0.002f * static_cast<float>(i);
    line.insert(line.end(), {glm::vec3(x, 0, 0), glm::vec3(x, 0.05f, 0)});
    plane.insert(plane.end(), {glm::vec3(x, 0, 0.01f * static_cast<float>(i % 10)), glm::vec3(x, 0.05f, 0)});
  }
  expect_head(head_under(of(line, 2)), "a line");
  expect_head(head_under(of(plane, 2)), "a plane");
}

// The fitted head would have to vanish to stay clear of a strand through its middle: the spheres give way,
// the skin does not.
TEST(HeadShape, AStrandThroughTheHeadIsNotSwallowed) {
  Groom groom = full_head();
  for (uint32_t i = groom.offset[7]; i < groom.offset[8]; ++i)
    groom.rest_position_m[i] =
        glm::vec3(0.0f, kRadiusM - 0.01f * static_cast<float>(i - groom.offset[7]), 0.0f);
  expect_head(head_under(groom), "through the middle");
}

TEST(HeadShape, TheSameGroomGivesTheSameHead) {
  const FittedHead a = head_under(full_head()), b = head_under(full_head());
  EXPECT_EQ(a.mesh.position_m, b.mesh.position_m);
  ASSERT_EQ(a.spheres.size(), b.spheres.size());
  for (size_t i = 0; i < a.spheres.size(); ++i) EXPECT_EQ(a.spheres[i].center_m, b.spheres[i].center_m);
}

// Hair that ends under the skin, as that of a ponytail under its band, does not pull the skin off the roots;
// what collides gives way to it.
TEST(HeadShape, TipsThatEndInTheHeadLeaveTheRootsOnTheSkin) {
  Groom groom = full_head();
  for (uint32_t strand = 0; strand < groom.strand_count(); strand += 5) {
    const uint32_t tip = groom.offset[strand + 1] - 1;
    const glm::vec3 root = groom.rest_position_m[groom.offset[strand]];
    groom.rest_position_m[tip] = 0.85f * glm::length(root) * glm::normalize(root + glm::vec3(0.02f, 0, 0));
  }
  const FittedHead head = head_under(groom);
  expect_head(head, "buried tips");
  EXPECT_LT(head.measure.root_median_m, 0.003);
  EXPECT_LT(head.measure.root_most_m, 0.006);
}

/// Hair that hangs from the built-in scalp, on the built-in shoulders or through where they are.
Groom hanging(float length_m, bool has_bust) {
  ProceduralGroomOptions options;
  options.strand_count = 400;
  options.length_m = length_m;
  options.has_bust = has_bust;
  return grow_groom(make_scalp_cap(glm::vec3(0.0f), kRadiusM, 500), options).value();
}

FittedHead bust_under(const Groom& groom) {
  FittedHead head;
  head.mesh = HeadShape(groom, {glm::vec3(0.0f), kRadiusM}, HeadFit::BustOnly).mesh();
  head.spheres = shrink_under(fit_spheres(head.mesh, kHeadSpheres, groom), groom);
  head.measure = measure_head(head.mesh, head.spheres, groom);
  return head;
}

/// Share of the vertices deeper than 1 mm in the drawn head.
double share_inside(const Groom& groom, const HeadShape& head) {
  double inside = 0.0;
  for (const glm::vec3& point : groom.rest_position_m)
    inside += groom.pinned[&point - groom.rest_position_m.data()] == 0 && head.distance_m(point) < -0.001
                  ? 1.0
                  : 0.0;
  return inside / static_cast<double>(groom.rest_position_m.size());
}

TEST(Shoulders, LieUnderHairThatWasGrownOnThem) {
  const Groom groom = hanging(0.35f, true);
  const FittedHead head = bust_under(groom);
  expect_head(head, "on the shoulders");
  const Mesh bald = HeadShape(Groom{}, {glm::vec3(0.0f), kRadiusM}, HeadFit::BustOnly).mesh();
  float moved_m = 0.0f;
  for (size_t i = 0; i < bald.position_m.size(); ++i)
    moved_m = std::max(moved_m, glm::distance(head.mesh.position_m[i], bald.position_m[i]));
  EXPECT_LT(moved_m, 0.003f) << "hardly anything has to give way";
  EXPECT_LT(head.measure.sphere_most_m, 0.014) << "what is drawn under hair is what collides";
  // Where hair lies on the bust it does not sink under the skin before something holds it.
  const PointTree hair(groom.rest_position_m);
  double under_hair = 0.0, uncovered = 0.0;
  for (const glm::vec3& point : head.mesh.position_m) {
    if (point.y > -1.5f * kRadiusM || hair.nearest(point, 1).front().distance_squared > 1e-4f) continue;
    under_hair += 1.0;
    uncovered += distance_to_spheres_m(head.spheres, point) > 0.004 ? 1.0 : 0.0;
  }
  ASSERT_GT(under_hair, 300.0);
  EXPECT_LT(uncovered / under_hair, 0.15);
}

// Hair that passes where shoulders would be comes from a person with others: these are lower and narrower.
TEST(Shoulders, GiveWayToHairThatPassesThem) {
  const Groom groom = hanging(0.35f, false);
  const FittedSphere skull{glm::vec3(0.0f), kRadiusM};
  const double as_it_is = share_inside(groom, HeadShape(Groom{}, skull, HeadFit::BustOnly));
  EXPECT_GT(as_it_is, 0.05);
  EXPECT_LT(share_inside(groom, HeadShape(groom, skull, HeadFit::BustOnly)), 0.25 * as_it_is);
  expect_head(bust_under(groom), "through the shoulders");
}

TEST(Shoulders, CollideOnlyWithHairThatReachesThem) {
  const auto lowest_m = [](const std::vector<FittedSphere>& spheres) {
    float low = 1.0f;
    for (const FittedSphere& sphere : spheres) low = std::min(low, sphere.center_m.y - sphere.radius_m);
    return low;
  };
  const FittedHead under_short = bust_under(hanging(0.06f, true)),
                   under_long = bust_under(hanging(0.35f, true));
  EXPECT_GT(lowest_m(under_short.spheres), -0.2f) << "the neck at most";
  EXPECT_LT(lowest_m(under_long.spheres), -0.3f);
  EXPECT_TRUE(std::any_of(under_long.spheres.begin(), under_long.spheres.end(),
                          [](const FittedSphere& sphere) { return std::abs(sphere.center_m.x) > 0.1f; }));
  // Of hair that reaches no more than the skin about its own roots only that collides: fewer spheres, which
  // cost less.
  const Groom tuft = picked(hanging(0.02f, true), [](const glm::vec3& p) { return p.y > 0.085f; });
  EXPECT_LE(bust_under(tuft).spheres.size(), 4u);
}

TEST(HeadSpheres, LieInsideTheMeshAndNearIt) {
  const Mesh head = make_head(0.095f);
  const std::vector<FittedSphere> spheres = fit_spheres(head, kHeadSpheres);
  ASSERT_EQ(spheres.size(), kHeadSpheres);
  // Samples stand 12 mm apart: between them a ball may come out by its sagitta there, and at creases by more.
  double sum_m = 0.0;
  for (const glm::vec3& point : head.position_m) {
    const double distance_m = distance_to_spheres_m(spheres, point);
    EXPECT_GT(distance_m, -0.006);
    sum_m += std::abs(distance_m);
  }
  EXPECT_LT(sum_m / static_cast<double>(head.position_m.size()), 0.010);
  // Triangles that face inwards make no difference.
  Mesh turned = head;
  for (glm::uvec3& triangle : turned.triangle) std::swap(triangle.x, triangle.y);
  const std::vector<FittedSphere> same = fit_spheres(turned, kHeadSpheres);
  ASSERT_EQ(same.size(), spheres.size());
  EXPECT_NEAR(same[0].radius_m, spheres[0].radius_m, 0.01f);
}

TEST(HeadSpheres, MeshesWithoutAnInsideGiveNone) {
  EXPECT_TRUE(fit_spheres({}, kHeadSpheres).empty());
  Mesh flat;
  flat.position_m.assign(3, glm::vec3(0.0f));
  flat.normal.assign(3, glm::vec3(0, 1, 0));
  flat.triangle = {{0, 1, 2}};
  EXPECT_TRUE(fit_spheres(flat, kHeadSpheres).empty()) << "no area";
  flat.position_m = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}};
  EXPECT_TRUE(fit_spheres(flat, kHeadSpheres).empty()) << "no volume";
}

TEST(Placement, EveryQuarterTurnIsFoundAgain) {
  const Groom groom = full_head();
  for (const float yaw_deg : {0.0f, 90.0f, 180.0f, -90.0f}) {
    GroomPlacement turn;
    turn.yaw_deg = yaw_deg;
    const Groom turned = moved(groom, [&](const glm::vec3& p) { return turn.place(p); });
    const Guess<float> guess = guess_yaw_deg(turned);
    EXPECT_FALSE(guess.reason.empty());
    turn.yaw_deg = guess.value;
    for (size_t i = 0; i < groom.rest_position_m.size(); i += 97)
      EXPECT_EQ(turn.place(turned.rest_position_m[i]), groom.rest_position_m[i]) << yaw_deg;
    // The same hair lying on its back: +Z of the file is up.
    const Groom lying = moved(turned, [](const glm::vec3& p) { return glm::vec3(p.x, -p.z, p.y); });
    EXPECT_STREQ(name_of(guess_up(turned).value), "+Y") << yaw_deg;
    EXPECT_STREQ(name_of(guess_up(lying).value), "+Z") << yaw_deg;
  }
}

TEST(Placement, EverySideThatIsUpIsFoundAndTurnedUp) {
  const Groom groom = full_head();
  for (const UpSide& side : {UpSide{false, false}, {true, false}, {false, true}, {true, true}}) {
    GroomPlacement upright;
    upright.is_z_up = side.is_z_up;
    upright.is_upside_down = side.is_upside_down;
    // The file has the hair so that this placement puts it upright.
    glm::mat3 head_from_file(0.0f);
    for (int axis = 0; axis < 3; ++axis) {
      glm::vec3 unit(0.0f);
      unit[axis] = 1.0f;
      head_from_file[axis] = upright.turn(unit);
    }
    EXPECT_NEAR(glm::determinant(head_from_file), 1.0f, 1e-6f) << "a turn, no mirror";
    const Groom in_file =
        moved(groom, [&](const glm::vec3& p) { return glm::transpose(head_from_file) * p; });
    const Guess<UpSide> guess = guess_up(in_file);
    EXPECT_STREQ(name_of(guess.value), name_of(side));
    EXPECT_EQ(guess.reason.empty(), !side.is_z_up && !side.is_upside_down);
    EXPECT_LT(glm::distance(upright.turn(in_file.rest_position_m[7]), groom.rest_position_m[7]), 1e-6f);
  }
}

/// Combed up, it would hang from the back of the head or an ear if that were up. As loaded it is.
TEST(Placement, HairThatStandsTurnsNoHead) {
  Groom punk = full_head();
  for (uint32_t strand = 0; strand < punk.strand_count(); ++strand)
    for (uint32_t i = punk.offset[strand]; i < punk.offset[strand + 1]; ++i)
      punk.rest_position_m[i] = punk.rest_position_m[punk.offset[strand]] +
                                glm::vec3(0.0f, 0.015f * static_cast<float>(i - punk.offset[strand]), 0.0f);
  for (const float yaw_deg : {0.0f, 90.0f}) {
    GroomPlacement turn;
    turn.yaw_deg = yaw_deg;
    const Groom turned = moved(punk, [&](const glm::vec3& p) { return turn.place(p); });
    EXPECT_STREQ(name_of(guess_up(turned).value), "+Y") << yaw_deg;
    EXPECT_EQ(lies_aside(turned, {}), nullptr) << yaw_deg;
  }
}

// Hair alike on both sides says where its face is, however few guides. The counter-example has no left side.
TEST(Placement, AFaceBetweenTwoQuarterTurnsIsFound) {
  const auto off_deg = [](const Groom& groom, float yaw_deg) {
    GroomPlacement turn;
    turn.yaw_deg = yaw_deg;
    const Groom turned = moved(groom, [&](const glm::vec3& p) { return turn.place(p); });
    return std::abs(std::remainder(guess_yaw_deg(turned).value + yaw_deg, 360.0f));
  };
  const Groom whole = full_head(), guides = full_head(143), other_guides = full_head(285);
  for (const float yaw_deg : {15.0f, 30.0f, 45.0f, 70.0f, -20.0f, -45.0f, -110.0f, 135.0f, -135.0f, 165.0f}) {
    EXPECT_LE(off_deg(whole, yaw_deg), 1.0f) << yaw_deg;
    EXPECT_LE(off_deg(other_guides, yaw_deg), 1.0f) << yaw_deg;
    EXPECT_LE(off_deg(guides, yaw_deg), 2.0f) << yaw_deg << ": 13 degrees between roots";
  }
  EXPECT_GT(off_deg(picked(whole, [](const glm::vec3& p) { return p.x > 0.0f; }), 15.0f), 20.0f);
}

// Files have their front at an axis. Hair that is not alike on both sides is no reason to turn it by some
// degrees; hair that is alike, is one.
TEST(Placement, HairThatIsLopsidedFacesTheAxisBesideIt) {
  REQUIRE_SHARED_DATA();
  const auto guessed = [](const Groom& groom, float yaw_deg) {
    GroomPlacement turn;
    turn.yaw_deg = yaw_deg;
    return guess_yaw_deg(moved(groom, [&](const glm::vec3& p) { return turn.place(p); })).value;
  };
  for (const char* const name : {"sintel_11400x16.tfx", "Ratboy_mohawk.tfx", "ponytail_front_top.tfx"}) {
    GroomFileOptions options;
    options.path = test::shared_data() / "grooms" / name;
    options.yaw_deg = std::nullopt;
    const Groom groom = load_groom(options).value();
    for (const float yaw_deg : {-6.0f, -3.0f, 0.0f, 3.0f, 6.0f, 8.0f})
      EXPECT_EQ(guessed(groom, yaw_deg), 0.0f) << name << " turned by " << yaw_deg;
  }
  EXPECT_NEAR(guessed(full_head(), 9.5f), -9.5f, 1.0f);
}

TEST(Placement, FurOfABodyIsNoHeadOfHair) {
  const Groom head = full_head();
  EXPECT_TRUE(is_hair_of_head(head));
  EXPECT_TRUE(is_hair_of_head(picked(head, [](const glm::vec3& p) { return p.x > 0.0f; }))) << "half of one";
  // The same on a long head; then roots all around a trunk that is three times as long as it is wide.
  EXPECT_TRUE(
      is_hair_of_head(moved(head, [](const glm::vec3& p) { return glm::vec3(p.x, p.y, 1.3f * p.z); })));
  Groom body;
  body.offset = {0};
  for (int i = 0; i < 400; ++i) {
    // Fibonacci's sphere, as a cigar.
    const double y = 1.0 - (2.0 * i + 1.0) / 400.0, around = 2.399963 * i, across = std::sqrt(1.0 - y * y);
    const glm::vec3 out(glm::dvec3(across * std::sin(around), y, 3.0 * across * std::cos(around)));
    body.rest_position_m.insert(body.rest_position_m.end(), {out, 1.05f * out});
    body.offset.push_back(static_cast<uint32_t>(body.rest_position_m.size()));
  }
  EXPECT_FALSE(is_hair_of_head(body));
}

/// Fibonacci's sphere: roots of fur all around.
Groom ball_of_fur(int strands, float radius) {
  Groom fur;
  fur.offset = {0};
  for (int i = 0; i < strands; ++i) {
    const double y = 1.0 - (2.0 * i + 1.0) / strands, around = 2.399963 * i, across = std::sqrt(1.0 - y * y);
    const glm::vec3 out(glm::dvec3(across * std::sin(around), y, across * std::cos(around)));
    fur.rest_position_m.insert(fur.rest_position_m.end(), {radius * out, 1.1f * radius * out});
    fur.pinned.insert(fur.pinned.end(), {1, 0});
    fur.offset.push_back(static_cast<uint32_t>(fur.rest_position_m.size()));
  }
  return fur;
}

TEST(Placement, FurOfABallLeavesNoRoomForAFace) {
  const Groom ball = ball_of_fur(400, 0.1f);
  EXPECT_FALSE(is_hair_of_head(ball));
  // Without what lies within 45 degrees of straight ahead, or below, it may be a head's.
  EXPECT_TRUE(is_hair_of_head(picked(ball, [](const glm::vec3& p) { return p.z < 0.07f; })));
  EXPECT_TRUE(is_hair_of_head(picked(ball, [](const glm::vec3& p) { return p.y > -0.07f; })));
}

/// The sphere through a disc may be any.
TEST(Placement, RootsInAPlaneTakeTheUnitThatTheirHairFits) {
  for (const auto& [unit_m, hair_m] :
       {std::pair{1.0f, 0.25f}, {0.01f, 0.25f}, {0.001f, 0.4f}, {0.01f, 1.0f}}) {
    Groom tail;
    tail.offset = {0};
    for (int i = 0; i < 200; ++i) {
      const double out_m = 0.02 * std::sqrt((i + 0.5) / 200.0), around = 2.399963 * i;
      const glm::dvec3 root_m(out_m * std::cos(around), 0.1, out_m * std::sin(around));
      const glm::dvec3 tip_m = root_m + glm::dvec3(0.0, 0.6, -0.8) * static_cast<double>(hair_m);
      tail.rest_position_m.push_back(glm::vec3(root_m) / unit_m);
      tail.rest_position_m.push_back(glm::vec3(tip_m) / unit_m);
      tail.offset.push_back(static_cast<uint32_t>(tail.rest_position_m.size()));
    }
    EXPECT_EQ(guess_unit(tail).value, unit_m) << guess_unit(tail).reason;
    EXPECT_TRUE(is_hair_of_head(tail)) << "nothing speaks against it";
    EXPECT_EQ(covered_head_radius(tail), 0.0f);
  }
}

// The counter-example is a head's: its size says the unit, however short its hair.
TEST(Placement, AFewStrandsTakeTheUnitThatTheirHairFits) {
  for (const float unit_m : {1.0f, 0.01f}) {
    const Groom few = moved(full_head(6), [&](const glm::vec3& p) { return p / unit_m; });
    EXPECT_EQ(guess_unit(few).value, unit_m) << guess_unit(few).reason;
  }
  const Groom head = moved(full_head(), [](const glm::vec3& p) { return 0.04f * p; });
  EXPECT_NEAR(guess_unit(head).value * 0.04f, 1.0f, 0.15f) << guess_unit(head).reason;
}

TEST(Placement, QuarterTurnsAgreeWithAnyOtherAngle) {
  GroomPlacement quarter, nearly;
  for (const float yaw_deg : {90.0f, 180.0f, -180.0f, -90.0f}) {
    quarter.yaw_deg = yaw_deg;
    nearly.yaw_deg = yaw_deg + 0.01f;
    EXPECT_LT(glm::distance(quarter.place({1, 2, 3}), nearly.place({1, 2, 3})), 2e-3f) << yaw_deg;
  }
  quarter.yaw_deg = 90.0f;
  EXPECT_EQ(quarter.turn({0, 0, 1}), glm::vec3(1, 0, 0)) << "counter-clockwise seen from above";
}

TEST(Placement, HairAllAroundHasNoFace) {
  const Groom fur = ball_of_fur(400, 1.0f);
  EXPECT_TRUE(guess_yaw_deg(fur).reason.empty());
  EXPECT_EQ(guess_yaw_deg(fur).value, 0.0f);
  EXPECT_TRUE(guess_up(fur).reason.empty());
}

TEST(Placement, AStatedTurnMovesHairAboutTheOrigin) {
  GroomPlacement placement;
  placement.is_z_up = true;
  placement.yaw_deg = 180.0f;
  placement.unit_m = 0.01f;
  placement.origin = {0, 150, 0};
  EXPECT_LT(glm::distance(placement.place({0, 0, 160}), glm::vec3(0.0f, 0.1f, 0.0f)), 1e-7f)
      << "10 cm above the head joint";
  EXPECT_EQ(placement.turn({0, -1, 0}), glm::vec3(0, 0, -1)) << "-Y of the file is forward, then half a turn";
}

/// What public grooms are known to be (their bangs and napes were looked at).
struct KnownGroom {
  std::vector<std::string> files;
  float yaw_deg;
  bool is_full_head;
};

TEST(Placement, RealGroomsFaceForwardOnAHeadThatSwallowsNothing) {
  REQUIRE_SHARED_DATA();
  const std::vector<KnownGroom> known = {{{"sintel_11400x16.tfx"}, 0.0f, true},
                                         {{"Ratboy_mohawk.tfx"}, 0.0f, false},
                                         {{"TestHair1.tfx"}, 0.0f, false},
                                         {{"ponytail_front_top.tfx"}, 180.0f, false},
                                         {{"ponytail_side.tfx", "ponytail_front_top.tfx"}, 180.0f, false}};
  for (const KnownGroom& item : known) {
    GroomFileOptions options;
    for (const std::string& file : item.files) {
      const std::filesystem::path path = test::shared_data() / "grooms" / file;
      if (options.path.empty()) {
        options.path = path;
      } else {
        options.more_paths.push_back(path);
      }
    }
    options.is_z_up = std::nullopt;
    options.yaw_deg = std::nullopt;
    const auto placed = load_placed_groom(options);
    ASSERT_TRUE(placed) << placed.error().to_string();
    EXPECT_FALSE(placed->placement.is_z_up) << item.files[0];
    EXPECT_EQ(placed->placement.yaw_deg, item.yaw_deg) << item.files[0];
    EXPECT_EQ(placed->is_of_head, item.files[0] != "TestHair1.tfx") << "which is fur all around";
    if (!placed->is_of_head) continue;
    const FittedHead head = head_under(placed->groom);
    expect_head(head, item.files[0]);
    if (!item.is_full_head) continue;
    EXPECT_LT(head.measure.root_median_m, 0.002) << item.files[0];
    EXPECT_LT(head.measure.root_most_m, 0.005) << item.files[0];
    EXPECT_LT(head.measure.sphere_most_m, 0.009) << item.files[0];
  }
}

TEST(GroomParts, SeveralFilesAreOneHeadOfHair) {
  REQUIRE_SHARED_DATA();
  GroomFileOptions options;
  options.path = test::shared_data() / "grooms/ponytail_side.tfx";
  const Groom one = load_groom(options).value();
  options.more_paths = {test::shared_data() / "grooms/ponytail_front_top.tfx"};
  options.unit_m = one.file_unit_m;
  const auto both = load_groom(options);
  ASSERT_TRUE(both) << both.error().to_string();
  EXPECT_EQ(both->strand_count(), 3'066u + 876u);
  EXPECT_TRUE(
      std::equal(one.rest_position_m.begin(), one.rest_position_m.end(), both->rest_position_m.begin()));
  options.more_paths.assign(kMaxGroomFiles, options.path);
  const auto many = load_groom(options);
  ASSERT_FALSE(many);
  EXPECT_THAT(many.error().to_string(), ::testing::HasSubstr("at most 8"));
  options.more_paths = {"no/such/part.tfx"};
  EXPECT_THAT(load_groom(options).error().to_string(), ::testing::HasSubstr("part.tfx"));
}

}  // namespace
}  // namespace strandcast::head_shape_test

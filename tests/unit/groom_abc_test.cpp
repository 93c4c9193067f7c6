// Strands in Alembic files that the tests put together: what is read, what is left out and said, and what is
// refused.
#include <algorithm>
#include <cmath>
#include <functional>

#include "common/groom/abc_curves.h"
#include "common/groom/abc_loader.h"
#include "common/groom/abc_tree.h"
#include "common/groom/curve_basis.h"
#include "common/groom/groom_file.h"
#include "tests/fuzz/groom_checks.h"
#include "tests/support/largest_allocation.h"
#include "tests/support/made_abc.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::groom_abc_test {
namespace {

using test::MadeAbc;
using test::MadeCurves;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr uint8_t kScale = 0x00, kTranslate = 0x10, kRotate = 0x20, kMatrix = 0x30, kRotateX = 0x40,
                  kRotateZ = 0x60;

class AbcTest : public ::testing::Test {
 protected:
  std::filesystem::path path() const { return folder_.path() / "hair.abc"; }

  /// Loads one curves object, alone in its file.
  Result<StatedGroom> loaded(const MadeCurves& curves, std::vector<AbcEntry> own = {},
                             std::vector<AbcEntry> free = {}) {
    return read_abc(file_.finish({file_.curves(curves, std::move(own), std::move(free))}));
  }
  Result<StatedGroom> placed(const std::vector<uint8_t>& ops, const std::vector<double>& channels) {
    MadeAbc file(path());
    return read_abc(file.finish({file.xform(ops, channels, true, {file.curves({})})}));
  }

  const TemporaryFolder folder_;
  MadeAbc file_{path()};
};

void expect_near(const Result<StatedGroom>& groom, const std::vector<glm::vec3>& expected) {
  ASSERT_TRUE(groom) << groom.error().to_string();
  const auto& points = groom->groom.rest_position_m;
  ASSERT_EQ(points.size(), expected.size());
  for (size_t i = 0; i < points.size(); ++i)
    EXPECT_LT(glm::distance(points[i], expected[i]), 1e-6f)
        << i << ": " << points[i].x << ", " << points[i].y << ", " << points[i].z;
}

std::string refusal(const Result<StatedGroom>& groom) {
  return groom ? "accepted" : groom.error().to_string();
}

TEST(MurmurKey, IsThePublishedFunction) {
  const auto key = [](std::string_view text) {
    const AbcKey found = murmur_key(std::as_bytes(std::span(text)));
    return fmt::format("{:016x}{:016x}", found[0], found[1]);
  };
  EXPECT_EQ(key(""), std::string(32, '0'));
  EXPECT_EQ(key("The quick brown fox jumps over the lazy dog"), "e34bbc7bbc071b6c7a433ca9c49a9347");
  EXPECT_NE(key("The quick brown fox jumps over the lazy cog"), "e34bbc7bbc071b6c7a433ca9c49a9347");
}

TEST_F(AbcTest, ReadsLinesWithUnitAndUpAxis) {
  const auto groom = read_abc(file_.finish({file_.curves({})}, "unit_m=0.01;up_axis=Z"));
  expect_near(groom, MadeCurves().points);
  EXPECT_EQ(groom->groom.offset, (std::vector<uint32_t>{0, 3, 5}));
  EXPECT_EQ(groom->groom.pinned, (std::vector<uint8_t>{1, 0, 0, 1, 0}));
  EXPECT_EQ(groom->unit_m, 0.01f);
  EXPECT_EQ(groom->is_z_up, true);
  // Others do not say, and both are guessed as of any file.
  MadeAbc silent(path());
  const auto unsaid = read_abc(silent.finish({silent.curves({})}, "_ai_Application=another"));
  EXPECT_FALSE(unsaid->unit_m || unsaid->is_z_up);
  GroomFileOptions options;
  options.path = path();
  options.unit_m = 0.5f;
  options.vertex_count = 3;
  EXPECT_EQ(load_placed_groom(options)->groom.rest_position_m.back(), glm::vec3(0.5f, 0, -0.5f));
}

TEST_F(AbcTest, TransformsAreThoseOfAlembic) {
  // The first operation is the outermost: scaled, then moved.
  expect_near(placed({kTranslate, kScale}, {1, 0, 0, 2, 1, 10}),
              {{1, 0, 0}, {1, 0, 10}, {1, 1, 25}, {3, 0, 0}, {3, 0, -10}});
  expect_near(placed({kScale, kTranslate}, {2, 1, 10, 1, 0, 0}),
              {{2, 0, 0}, {2, 0, 10}, {2, 1, 25}, {4, 0, 0}, {4, 0, -10}});
  // About X first: +Z becomes -Y, and about Z that becomes +X. Hints do not matter.
  expect_near(placed({kRotateZ | 7, kRotateX | 1}, {90, 90}),
              {{0, 0, 0}, {1, 0, 0}, {2.5f, 0, 1}, {0, 1, 0}, {-1, 1, 0}});
  expect_near(placed({kRotate}, {0, 0, 2, 180}),
              {{0, 0, 0}, {0, 0, 1}, {0, -1, 2.5f}, {-1, 0, 0}, {-1, 0, -1}});
  // A row is what Alembic multiplies a row vector with: the last one moves.
  expect_near(placed({kMatrix}, {0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1}),
              {{5, 6, 7}, {5, 6, 8}, {4, 6, 9.5f}, {5, 7, 7}, {5, 7, 6}});
  EXPECT_THAT(refusal(placed({0xf0}, {1})), AllOf(HasSubstr("/xform"), HasSubstr("unknown operation 15")));
  EXPECT_THAT(refusal(placed({kTranslate, kScale}, {1, 2, 3, 4, 5})), HasSubstr("more than the 5 numbers"));
}

TEST_F(AbcTest, AnXformMayLeaveOutWhatIsAboveIt) {
  for (const bool is_inheriting : {true, false}) {
    MadeAbc file(path());
    auto inner = file.xform({kTranslate}, {0, 0, 3}, is_inheriting, {file.curves({})});
    const auto groom = read_abc(file.finish({file.xform({kTranslate}, {1, 0, 0}, true, {inner})}));
    ASSERT_TRUE(groom) << groom.error().to_string();
    EXPECT_EQ(groom->groom.rest_position_m[0], glm::vec3(is_inheriting ? 1 : 0, 0, 3));
  }
}

TEST_F(AbcTest, InstancesStandWhereTheyAre) {
  auto source = file_.xform({kTranslate}, {1, 0, 0}, true, {file_.curves({})});
  source.name = "source";
  auto copy = file_.xform({kTranslate}, {0, 0, 9}, true, {file_.instance("tuft", "/source")});
  const auto groom =
      read_abc(file_.finish({std::move(source), std::move(copy), file_.instance("lost", "/nothing")}));
  ASSERT_TRUE(groom) << groom.error().to_string();
  ASSERT_EQ(groom->groom.strand_count(), 4u);
  for (size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(groom->groom.rest_position_m[i], MadeCurves().points[i] + glm::vec3(1, 0, 0));
    EXPECT_EQ(groom->groom.rest_position_m[5 + i], MadeCurves().points[i] + glm::vec3(1, 0, 9));
  }
  EXPECT_THAT(groom->notes, Contains(HasSubstr("1 instance is hair of its own")));
  EXPECT_THAT(groom->notes, Contains(HasSubstr("1 instance is left out")));
  // One that stands for what holds it would never end.
  MadeAbc endless(path());
  auto outer = endless.xform({}, {}, true, {endless.instance("again", "/xform")});
  EXPECT_THAT(refusal(read_abc(endless.finish({std::move(outer)}))), HasSubstr("objects in each other"));
}

TEST_F(AbcTest, AnObjectIsLookedUpOnceForAllItsInstances) {
  // To look among 10,000 names for each of them would read a gigabyte.
  constexpr size_t kInstances = 10'000;
  std::vector<AbcItem> items = {file_.curves({})};
  for (size_t i = 0; i < kInstances; ++i) items.push_back(file_.instance(fmt::format("{}", i), "/hair"));
  const auto groom = read_abc(file_.finish(std::move(items)));
  ASSERT_TRUE(groom) << groom.error().to_string();
  EXPECT_EQ(groom->groom.strand_count(), 2 * (kInstances + 1));
}

TEST_F(AbcTest, HiddenObjectsAreLeftOutUnlessTheyAreShownAgain) {
  const auto visible = [](MadeAbc& file, int8_t value) {
    return file.entry("visible", AbcForm::Scalar, static_cast<AbcType>(2), 1, std::array{value});
  };
  for (const int8_t value : {int8_t{-1}, int8_t{1}}) {
    MadeAbc file(path());
    AbcItem inner = file.curves({});
    inner.entries.push_back(visible(file, value));
    auto outer = file.xform({}, {}, true, {std::move(inner)});
    outer.entries.push_back(visible(file, 0));
    const auto groom = read_abc(file.finish({std::move(outer)}));
    EXPECT_EQ(groom.ok(), value == 1);
    if (value != 1) {
      EXPECT_THAT(refusal(groom), HasSubstr("hidden"));
    }
  }
}

TEST_F(AbcTest, CubicCurvesBecomePointsOnThem) {
  MadeCurves cubic;
  cubic.points = {{0, 0, 0}, {1, 3, 0}, {2, 0, 0}, {3, 3, 0}, {4, 0, 0}};
  cubic.counts = {5};
  const auto with = [&](uint8_t type, uint8_t basis, std::vector<double> knots) {
    MadeAbc file(path());
    cubic.kinds = {type, 0, basis, basis};
    std::vector<AbcEntry> own;
    const std::vector<float> numbers(knots.begin(), knots.end());
    if (!numbers.empty()) own.push_back(file.entry(".knots", AbcForm::Array, AbcType::Float, 1, numbers));
    return read_abc(file.finish({file.curves(cubic, std::move(own))}));
  };
  constexpr uint8_t kCubic = 0, kLinear = 1, kBSpline = 2, kCatmullRom = 3;
  // Without knots a B-spline begins inside: at 1/6, 4/6, 1/6 of its first points.
  EXPECT_LT(glm::distance(with(kCubic, kBSpline, {})->groom.rest_position_m[0], glm::vec3(1, 2, 0)), 1e-6f);
  const auto clamped = with(kCubic, kBSpline, {0, 0, 0, 0, 1, 2, 2, 2, 2});
  EXPECT_EQ(clamped->groom.rest_position_m.front(), cubic.points.front());
  EXPECT_EQ(clamped->groom.rest_position_m.back(), cubic.points.back());
  EXPECT_THAT(clamped->notes, Contains(HasSubstr("1 cubic curve (bspline) became as many points")));
  EXPECT_LT(glm::distance(with(kCubic, kCatmullRom, {})->groom.rest_position_m[0], cubic.points[1]), 1e-6f);
  // Blender's hair: points on the strand, whatever the basis.
  expect_near(with(kLinear, kCatmullRom, {}), cubic.points);
  EXPECT_THAT(refusal(with(kCubic, 1, {})), AllOf(HasSubstr("/hair, strand 0"), HasSubstr("bezier")));
  EXPECT_THAT(refusal(with(kCubic, 4, {})), HasSubstr("of a kind that is not read"));
  EXPECT_THAT(refusal(with(kCubic, kBSpline, {0, 0, 0, 0, 2, 1, 2, 2, 2})), HasSubstr("knots may not fall"));
}

TEST(KnotCurves, AreTheCurvesThatTheirKnotsSay) {
  const std::vector<glm::vec3> control = {{0, 0, 0}, {1, 3, 0}, {2, 0, 1}, {3, 3, 0}, {4, 1, 0}};
  const auto expect_same = [](const auto& found, const auto& expected) {
    ASSERT_TRUE(found && expected);
    for (size_t i = 0; i < found->size(); ++i)
      EXPECT_LT(glm::distance((*found)[i], (*expected)[i]), 1e-5f) << i;
  };
  // Even knots make an open B-spline, and knots at the ends alone a Bezier curve.
  const std::vector<double> even = {0, 1, 2, 3, 4, 5, 6, 7, 8};
  expect_same(points_on_curve(KnotCurve{control, {}, even, 4}),
              points_on_curve(control, CurveBasis::BSpline, CurveEnds::Open));
  const std::vector<double> ends = {0, 0, 0, 0, 1, 1, 1, 1};
  const auto four = std::span(control).first(4);
  expect_same(points_on_curve(KnotCurve{four, {}, ends, 4}),
              points_on_curve(four, CurveBasis::Bezier, CurveEnds::Open));
  // A quarter of a circle needs weights; without them it is none.
  const std::vector<glm::vec3> corner = {{1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  const std::vector<double> knots = {0, 0, 0, 1, 1, 1}, weights = {1.0, std::sqrt(0.5), 1.0};
  EXPECT_NEAR(glm::length((*points_on_curve(KnotCurve{corner, weights, knots, 3}))[1]), 1.0f, 1e-6f);
  EXPECT_GT(glm::length((*points_on_curve(KnotCurve{corner, {}, knots, 3}))[1]), 1.05f);
  // Of order 2 the curve is the polygon.
  const std::vector<double> lines = {0, 0, 1, 2, 3, 4, 4};
  expect_same(points_on_curve(KnotCurve{control, {}, lines, 2}), Result<std::vector<glm::vec3>>(control));
  EXPECT_FALSE(points_on_curve(KnotCurve{control, {}, ends, 4})) << "a knot too few";
  EXPECT_FALSE(points_on_curve(KnotCurve{four, {}, std::vector<double>(8, 1.0), 4})) << "no length";
  EXPECT_FALSE(points_on_curve(KnotCurve{corner, std::vector<double>{1, 0, 1}, knots, 3})) << "no weight";
}

TEST_F(AbcTest, ScopesAreThoseThatFitTheCount) {
  AbcCurves curves;
  curves.vertex_counts = {3, 2};
  curves.points.resize(5);
  const auto scope_of = [&](size_t count, const char* stated) {
    AbcParam param;
    param.stated_scope = stated;
    param.values = {std::vector<std::byte>(count * sizeof(float)), AbcPod::Float, 1};
    return curves.scope_of(param);
  };
  EXPECT_EQ(scope_of(1, "con"), AbcScope::Constant);
  EXPECT_EQ(scope_of(2, "uni"), AbcScope::Strand);
  EXPECT_EQ(scope_of(5, "vtx"), AbcScope::Vertex);
  EXPECT_EQ(scope_of(5, "var"), AbcScope::Varying);
  EXPECT_EQ(scope_of(2, ""), AbcScope::Strand) << "as Blender leaves it";
  EXPECT_EQ(scope_of(5, "con"), AbcScope::Vertex) << "what is stated does not fit";
  EXPECT_EQ(scope_of(3, "vtx"), std::nullopt);
  curves.type = AbcCurveType::Cubic;
  curves.basis = AbcBasis::BSpline;
  curves.vertex_counts = {7, 4};
  curves.points.resize(11);
  EXPECT_EQ(scope_of(5 + 2, "var"), AbcScope::Varying) << "four segments and one, each and one more";
}

TEST_F(AbcTest, RootCoordinatesComeFromEitherName) {
  const std::vector<glm::vec2> uv = {{0.25f, 0.5f}, {0.75f, 1.0f}};
  const std::vector<glm::vec3> three = {{0.25f, 0.5f, 7}, {0.75f, 1.0f, 7}};
  const std::vector<glm::vec2> for_points = {{0.25f, 0.5f}, {9, 9}, {9, 9}, {0.75f, 1.0f}, {9, 9}};
  const std::vector<glm::vec2> swapped = {{0.75f, 1.0f}, {0.25f, 0.5f}};
  const std::vector<uint32_t> indices = {1, 0};
  const auto root_uv = [&](const std::function<AbcEntry(MadeAbc&)>& entry) {
    MadeAbc file(path());
    return read_abc(file.finish({file.curves({}, {entry(file)})}))->groom.root_uv;
  };
  EXPECT_EQ(root_uv([&](MadeAbc& file) { return file.param("uv", AbcType::Float, 2, uv); }), uv);
  EXPECT_EQ(root_uv([&](MadeAbc& file) { return file.param("uv", AbcType::Float, 3, three, "uni"); }), uv);
  EXPECT_EQ(root_uv([&](MadeAbc& file) { return file.param("uv", AbcType::Float, 2, for_points, "vtx"); }),
            uv);
  EXPECT_EQ(root_uv([&](MadeAbc& file) {
              return MadeAbc::compound("uv", {file.param(".vals", AbcType::Float, 2, swapped),
                                              file.param(".indices", AbcType::U32, 1, indices)});
            }),
            uv);
  const std::vector<glm::vec2> one(1);
  EXPECT_TRUE(root_uv([&](MadeAbc& file) { return file.param("uv", AbcType::Float, 2, one); }).empty());
}

TEST_F(AbcTest, GuidesAreHairOnlyWhereTheyAreAlone) {
  const auto with_guides = [&](std::vector<int16_t> flags, GuideUse use = GuideUse::LeaveOut) {
    MadeAbc file(path());
    const std::vector<glm::vec2> uv = {{0.25f, 0.5f}, {0.75f, 1.0f}};
    const std::vector<int32_t> groups = {0, 4};
    return read_abc(file.finish({file.curves({}, {},
                                             {file.param("groom_guide", AbcType::I16, 1, flags, "uni"),
                                              file.param("groom_group_id", AbcType::I32, 1, groups),
                                              file.param("groom_root_uv", AbcType::Float, 2, uv, "uni")})}),
                    use);
  };
  const auto asked_for = with_guides({0, 1}, GuideUse::Alone);
  expect_near(asked_for, {{1, 0, 0}, {1, 0, -1}});
  EXPECT_THAT(asked_for->notes, Contains(HasSubstr("1 guide (groom_guide) is the hair")));
  const auto mixed = with_guides({1, 0});
  expect_near(mixed, {{1, 0, 0}, {1, 0, -1}});
  EXPECT_EQ(mixed->groom.root_uv, (std::vector<glm::vec2>{{0.75f, 1.0f}}));
  EXPECT_THAT(mixed->notes, Contains(HasSubstr("1 guide (groom_guide) is left out")));
  EXPECT_THAT(mixed->notes, Contains(HasSubstr("2 groups (groom_group_id)")));
  const auto alone = with_guides({1, 1});
  expect_near(alone, MadeCurves().points);
  EXPECT_THAT(alone->notes, Contains(HasSubstr("all strands are guides")));
  const auto none = with_guides({0, 0});
  expect_near(none, MadeCurves().points);
  EXPECT_THAT(none->notes, Not(Contains(HasSubstr("guides"))));
}

TEST_F(AbcTest, GuidesOfAnObjectOfTheirOwnNeedNoIdsAndRootCoordinates) {
  for (const int16_t is_guide : {int16_t{1}, int16_t{0}}) {
    MadeAbc file(path());
    const std::vector<glm::vec2> uv = {{0.25f, 0.5f}, {0.75f, 1.0f}};
    const std::vector<int16_t> flag = {is_guide};
    auto other = file.curves({}, {}, {file.param("groom_guide", AbcType::I16, 1, flag)});
    other.name = "other";
    const std::vector<int32_t> id = {7, 8};
    auto hair = file.curves({}, {},
                            {file.param("groom_root_uv", AbcType::Float, 2, uv, "uni"),
                             file.param("groom_id", AbcType::I32, 1, id, "uni")});
    const auto groom = read_abc(file.finish({std::move(hair), std::move(other)}));
    ASSERT_TRUE(groom) << groom.error().to_string();
    EXPECT_EQ(groom->labels.id, is_guide == 1 ? id : (std::vector<int32_t>{7, 8, 9, 10}));
    EXPECT_EQ(groom->groom.strand_count(), is_guide == 1 ? 2u : 4u);
    std::vector<glm::vec2> all = uv;
    if (is_guide == 0) all.insert(all.end(), uv.begin(), uv.end());  // they lie where the others do
    EXPECT_EQ(groom->groom.root_uv, all);
  }
}

TEST_F(AbcTest, OfSamplesTheFirstIsTheGroom) {
  MadeCurves moving;
  moving.shift = {0, 1, 2};
  const auto groom = loaded(moving);
  expect_near(groom, moving.points);
  EXPECT_THAT(groom->notes, Contains(HasSubstr("as at 0.5 s, the first of 3 samples")));
}

TEST_F(AbcTest, SamplesAreFoundThoughEqualOnesAreNotStored) {
  // At both ends equal ones are left out; in between they are not, and a shape may come back.
  for (const std::vector<float>& shift :
       {std::vector<float>{0, 0, 0, 1, 2, 2, 3, 3, 3}, {0, 1, 0, 1, 1, 1, 0}, {0, 0, 0}, {0, 1}, {4, 4, 5}}) {
    MadeAbc file(path());
    MadeCurves moving;
    moving.shift = shift;
    const auto bytes = file.finish({file.curves(moving)});
    const auto archive = AbcArchive::read(*AbcContainer::of(bytes));
    const auto objects = archive->objects(archive->top());
    const auto reader = AbcCurvesReader::open(*archive, objects->at(0));
    ASSERT_TRUE(reader) << reader.error().to_string();
    ASSERT_EQ(reader->sample_count(), shift.size());
    for (size_t i = 0; i < shift.size(); ++i) {
      const auto curves = reader->read(i, kMaxStrandCount, kMaxGroomVertices);
      ASSERT_TRUE(curves) << curves.error().to_string();
      EXPECT_EQ(curves->points[0].x, shift[i]) << i << " of " << shift.size();
      const bool is_timed = shift.size() > 1;
      EXPECT_EQ(reader->time_s(i), is_timed ? 0.5 + 0.25 * static_cast<double>(i) : 0.0);
    }
  }
}

TEST_F(AbcTest, TransformsAreTakenAtTheTimeOfTheCurves) {
  // Samples of both begin at 0.5 s, a quarter of a second apart.
  const auto bytes = file_.finish({file_.moving_xform({0, 1, 2}, {file_.curves({})})});
  const auto archive = AbcArchive::read(*AbcContainer::of(bytes));
  const auto tree = AbcTree::read(*archive);
  ASSERT_TRUE(tree) << tree.error().to_string();
  ASSERT_EQ(tree->nodes().size(), 3u);
  EXPECT_THAT(read_abc(bytes)->notes, Contains(HasSubstr("1 curves object stands as its first transform")));
  for (const auto& [time_s, x] :
       {std::pair(-3.0, 0.0), {0.5, 0.0}, {0.6, 0.0}, {0.65, 1.0}, {0.75, 1.0}, {0.9, 2.0}, {100.0, 2.0}}) {
    const auto world = tree->world_from_node(*archive, 2, time_s);
    ASSERT_TRUE(world) << world.error().to_string();
    EXPECT_EQ((*world)[3].x, x) << time_s;
  }
}

TEST_F(AbcTest, ShortStrandsAreLeftOutAndOthersOfSeveralObjectsAreOneGroom) {
  MadeCurves few;
  few.counts = {1, 2, 2};
  AbcItem second = file_.curves({});
  second.name = "more";
  const auto groom = read_abc(file_.finish({file_.curves(few), std::move(second)}));
  ASSERT_TRUE(groom) << groom.error().to_string();
  EXPECT_EQ(groom->groom.offset, (std::vector<uint32_t>{0, 2, 4, 7, 9}));
  EXPECT_EQ(groom->groom.rest_position_m[0], few.points[1]);
  EXPECT_THAT(
      groom->notes,
      Contains(HasSubstr("1 of 5 strands cannot be used, and are left out; the first: hair: strand 0")));
  few.counts = {1, 0, 2, 2};
  MadeAbc other(path());
  EXPECT_THAT(refusal(read_abc(other.finish({other.curves(few)}))),
              HasSubstr("2 of 4 strands cannot be used"));
  EXPECT_THAT(groom->notes, Contains(HasSubstr("strands of 2 curves objects")));
}

TEST_F(AbcTest, WhatIsWrongIsNamedWithItsObject) {
  const auto made = [&](const std::function<void(MadeCurves&)>& change) {
    MadeAbc file(path());
    MadeCurves curves;
    change(curves);
    return refusal(read_abc(file.finish({file.curves(curves)})));
  };
  EXPECT_EQ(made([](MadeCurves&) {}), "accepted");
  EXPECT_THAT(made([](MadeCurves& c) { c.counts = {3, -2}; }), HasSubstr("/hair: strand 1 has -2 vertices"));
  EXPECT_THAT(made([](MadeCurves& c) {
                c.counts = {3, 1};
              }),
              HasSubstr("nVertices need 4 points, there are 5"));
  EXPECT_THAT(made([](MadeCurves& c) { c.points[2].y = NAN; }),
              HasSubstr("strand 0 vertex 2 has the coordinates"));
  EXPECT_THAT(made([](MadeCurves& c) { c.kinds[0] = 9; }), HasSubstr("curve type 9"));
  EXPECT_THAT(made([](MadeCurves& c) { c.kinds[2] = 77; }), HasSubstr("curve basis 77"));
  EXPECT_THAT(made([](MadeCurves& c) { c.kinds[1] = 1; }), HasSubstr("closed"));
  EXPECT_THAT(made([](MadeCurves& c) { c.counts.assign(kMaxStrandCount + 1, 0); }),
              HasSubstr("at most 200000"));
  MadeAbc file(path());
  EXPECT_THAT(refusal(read_abc(file.finish({}))), HasSubstr("no curves"));
  EXPECT_THAT(refusal(read_abc(std::as_bytes(std::span("ogawa")))), HasSubstr("does not begin with 'Ogawa'"));
}

TEST_F(AbcTest, AFileThatIsNotFinishedIsRecognised) {
  const AbcItem curves = file_.curves({});
  const MadeCurves many{"more", {1, 0, 0, 0}, {100'000}, std::vector<glm::vec3>(100'000), {0}};
  const AbcItem more = file_.curves(many);  // beyond what the file keeps in memory
  std::filesystem::path part = path();
  part += ".part";
  EXPECT_THAT(refusal(load_abc(part)), HasSubstr("did not finish"));
  (void)file_.finish({curves});
  EXPECT_EQ(refusal(load_abc(path())), "accepted");
  const auto whole = load_file(path(), 1 << 22);
  ASSERT_TRUE(whole);
  for (const size_t size : {whole->size() - 60, whole->size() / 2, size_t{20}})
    EXPECT_THAT(refusal(read_abc(std::span(*whole).first(size))),
                AllOf(HasSubstr(fmt::format("cut off at byte {}", size)), HasSubstr("copy it again")));
  EXPECT_THAT(refusal(load_abc(folder_.path() / "none.abc")), HasSubstr("no such file"));
  EXPECT_THAT(refusal(load_abc(folder_.path())), HasSubstr("not a regular file"));
}

TEST_F(AbcTest, SamplesThatStandStillTakeNoSpaceAndNoTime) {
  // 70,000 equal samples are stored once; that so many are there takes four bytes.
  constexpr uint32_t kSamples = 70'000, kClaimed = 4'000'000'000;
  AbcItem curves = file_.curves({});
  AbcSeries& series = curves.entries[0].entries[0].series;
  series.sample.assign(kSamples, series.sample[0]);
  auto bytes = file_.finish({std::move(curves)});
  EXPECT_LT(bytes.size(), 2'000u);
  EXPECT_TRUE(read_abc(bytes));
  const auto claim = std::as_bytes(std::span(&kSamples, 1));
  const auto found = std::search(bytes.begin(), bytes.end(), claim.begin(), claim.end());
  ASSERT_NE(found, bytes.end());
  std::memcpy(&*found, &kClaimed, sizeof(kClaimed));
  test::reset_largest_allocation();
  const auto groom = read_abc(bytes);
  expect_near(groom, MadeCurves().points);
  EXPECT_THAT(groom->notes, Contains(HasSubstr("first of 4000000000 samples")));
  EXPECT_LT(test::largest_allocation_bytes(), 10'000u);
}

TEST_F(AbcTest, LoopsAndTooDeepOnesEnd) {
  const auto nested = [&](size_t depth) {
    MadeAbc file(path());
    AbcItem item = file.curves({});
    for (size_t i = 0; i < depth; ++i) item = {"x", "schema=AbcGeom_Xform_v3", {}, {std::move(item)}};
    return file.finish({std::move(item)});
  };
  EXPECT_EQ(refusal(read_abc(nested(1'500))), "accepted");
  EXPECT_THAT(refusal(read_abc(nested(kMaxAbcDepth + 1))), HasSubstr("objects in each other"));
  // A transform that holds the top object.
  auto loop = nested(3);
  const auto container = AbcContainer::of(loop);
  const AbcChild top = *container->child(*container->group(container->root()), 2);
  const AbcGroup top_group = *container->group(top);
  const AbcGroup first = *container->group(*container->child(top_group, 1));
  std::memcpy(loop.data() + first.offset + sizeof(AbcChild), &top, sizeof(top));
  EXPECT_THAT(refusal(read_abc(loop)), HasSubstr("objects in each other"));
  // Each of twenty objects is in the one above it twice: a million paths.
  MadeAbc file(path());
  AbcItem item = file.curves({});
  for (int i = 0; i < 20; ++i) {
    AbcItem twice{"x", "", {}, {item, {"y", "", {}, {}}}};
    item = std::move(twice);
  }
  auto shared = file.finish({std::move(item)});
  const auto of_shared = AbcContainer::of(shared);
  AbcGroup group = *of_shared->group(*of_shared->child(*of_shared->group(of_shared->root()), 2));
  group = *of_shared->group(*of_shared->child(group, 1));
  for (int i = 0; i < 20; ++i) {
    const AbcChild inner = *of_shared->child(group, 1);
    std::memcpy(shared.data() + group.offset + 2 * sizeof(AbcChild), &inner, sizeof(inner));
    group = *of_shared->group(inner);
  }
  EXPECT_THAT(refusal(read_abc(shared)), HasSubstr("more than 100000 objects"));
}

TEST_F(AbcTest, AllReadsTogetherHaveALimit) {
  MadeCurves large;
  large.counts = {1'000'000};
  large.points.resize(1'000'000);
  const auto bytes = file_.finish({file_.curves(large)});
  const auto container = AbcContainer::of(bytes);
  constexpr uint64_t kBlockBytes = 16u << 20;
  const AbcBlock block{16, bytes.size() - 16};
  uint64_t count = 0;
  while (container->read(block, kBlockBytes)) ++count;
  EXPECT_EQ(count, kMaxGroomReadBytes / block.size_bytes);
  EXPECT_THAT(container->read(block, kBlockBytes).error().to_string(),
              HasSubstr("more than 536870912 bytes"));
}

/// A file with something of each kind.
std::vector<std::byte> rich_file(const std::filesystem::path& path) {
  MadeAbc file(path);
  MadeCurves moving;
  moving.shift = {0, 1, 2};
  const std::vector<int16_t> guides = {1, 0};
  const std::vector<float> widths = {0.1f};
  auto source = file.xform({kTranslate, kRotateX}, {1, 0, 0, 90}, true,
                           {file.curves(moving, {file.param("width", AbcType::Float, 1, widths, "con")},
                                        {file.param("groom_guide", AbcType::I16, 1, guides, "uni")})});
  source.name = "source";
  return file.finish({std::move(source), file.instance("copy", "/source")}, "unit_m=0.01");
}

TEST_F(AbcTest, EveryTruncationIsRefused) {
  const auto whole = rich_file(path());
  ASSERT_EQ(refusal(read_abc(whole)), "accepted");
  for (size_t size = 0; size < whole.size(); ++size)
    ASSERT_NE(refusal(read_abc(std::span(whole).first(size))), "accepted") << size << " of " << whole.size();
}

TEST_F(AbcTest, EveryDamagedByteGivesASentenceOrASoundGroom) {
  constexpr size_t kSmallBytes = 64u << 10;
  const auto whole = rich_file(path());
  size_t refused = 0;
  for (size_t at = 0; at < whole.size(); ++at) {
    for (const std::byte flip : {std::byte{1}, std::byte{0x80}, std::byte{0xff}}) {
      auto damaged = whole;
      damaged[at] ^= flip;
      test::reset_largest_allocation();
      const auto groom = read_abc(damaged);
      EXPECT_LT(test::largest_allocation_bytes(), whole.size() + kSmallBytes) << at;
      if (groom) {
        check_loaded_groom(groom->groom);
        continue;
      }
      ++refused;
      EXPECT_EQ(groom.error().to_string().find('\n'), std::string::npos);
    }
  }
  EXPECT_GT(refused, whole.size() / 4);
}

}  // namespace
}  // namespace strandcast::groom_abc_test

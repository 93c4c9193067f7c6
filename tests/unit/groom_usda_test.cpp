// Strands in USD text files: what is read, what is left out and said, and what is refused with its line.
#include <cmath>

#include "common/base/file.h"
#include "common/groom/curve_basis.h"
#include "common/groom/groom_file.h"
#include "common/groom/usd_loader.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::groom_usda_test {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

std::string refusal(const std::string& text) {
  const auto groom = read_usd(text);
  return groom ? "accepted" : groom.error().to_string();
}
/// A stage with one prim of curves in a transform; `body` follows the points.
std::string stage(const std::string& body, const std::string& xform = "", const std::string& layer = "") {
  return "#usda 1.0\n(\n    doc = \"\"\"two\nlines, } and #\"\"\"\n    metersPerUnit = 0.01\n    upAxis = "
         "\"Z\"\n" +
         layer + ")\n\ndef Xform \"Head\" (\n    kind = \"component\"\n)\n{\n" + xform +
         "    def BasisCurves \"Hair\"\n    {\n" + body + "    }\n}\n";
}
const std::string kLines =
    "uniform token type = \"linear\"\nint[] curveVertexCounts = [3, 2]\n"
    "point3f[] points = [(0, 0, 0), (0, 0, 1), (0, 1, 2.5e0), (1, 0, 0), (1, 0, -1)]\n";
const std::vector<glm::vec3> kPoints = {{0, 0, 0}, {0, 0, 1}, {0, 1, 2.5f}, {1, 0, 0}, {1, 0, -1}};

void expect_near(const std::vector<glm::vec3>& points, const std::vector<glm::vec3>& expected) {
  ASSERT_EQ(points.size(), expected.size());
  for (size_t i = 0; i < points.size(); ++i)
    EXPECT_LT(glm::distance(points[i], expected[i]), 1e-6f)
        << i << ": " << points[i].x << ", " << points[i].y << ", " << points[i].z;
}
std::vector<glm::vec3> points_with(const std::string& xform) {
  const auto groom = read_usd(stage(kLines, xform));
  EXPECT_TRUE(groom) << groom.error().to_string();
  return groom ? groom->groom.rest_position_m : std::vector<glm::vec3>{};
}

TEST(Usda, ReadsLinesWithUnitAndUpAxis) {
  const auto groom = read_usd(stage(kLines));
  ASSERT_TRUE(groom) << groom.error().to_string();
  EXPECT_EQ(groom->groom.offset, (std::vector<uint32_t>{0, 3, 5}));
  EXPECT_EQ(groom->groom.rest_position_m, kPoints);
  EXPECT_EQ(groom->groom.pinned, (std::vector<uint8_t>{1, 0, 0, 1, 0}));
  EXPECT_EQ(groom->unit_m, 0.01f);
  EXPECT_EQ(groom->is_z_up, true);
}

TEST(Usda, AByteOrderMarkIsNoPartOfTheFile) {
  const auto groom = read_usd("\xef\xbb\xbf" + stage(kLines));
  ASSERT_TRUE(groom) << groom.error().to_string();
  EXPECT_EQ(groom->groom.rest_position_m, kPoints);
}

// "#" begins a comment elsewhere.
TEST(Usda, AWordThatIsNoNumberCostsItsStrandAlone) {
  std::string counts, points;
  for (int strand = 0; strand < 10; ++strand) {
    counts += "2, ";
    points += fmt::format("({0}, 0, 0), ({0}, 1, 0), ", strand);
  }
  for (const std::string word : {"-1.#IND", "1.#QNAN00", "abc", "nan", "\"a\""}) {
    std::string broken = points;
    broken.replace(broken.find("(3, 1") + 4, 1, word);
    const auto groom = read_usd(stage("uniform token type = \"linear\"\nint[] curveVertexCounts = [" +
                                      counts + "]\npoint3f[] points = [" + broken + "] # 1.#END\n"));
    ASSERT_TRUE(groom) << word << ": " << groom.error().to_string();
    EXPECT_EQ(groom->groom.strand_count(), 9u) << word;
    EXPECT_THAT(groom->notes,
                Contains(AllOf(HasSubstr("1 of 10 strands cannot be used"), HasSubstr("strand 3 vertex 1"))))
        << word;
  }
}

TEST(Usda, UnitAndAxisAreStatedAndSaidInTheNotes) {
  const TemporaryFolder folder;
  GroomFileOptions options;
  options.path = folder.write("hair.usda", stage(kLines));
  options.is_z_up.reset();
  const auto placed = load_placed_groom(options);
  ASSERT_TRUE(placed) << placed.error().to_string();
  EXPECT_TRUE(placed->placement.is_z_up);
  EXPECT_FLOAT_EQ(placed->placement.unit_m, 0.01f);
  EXPECT_THAT(placed->notes, Contains(HasSubstr("1 unit = 10 mm: its metersPerUnit says so")));
  EXPECT_THAT(placed->notes, Contains(HasSubstr("+Z of the file is up: its upAxis says so")));
  options.unit_m = 0.5f;
  EXPECT_FLOAT_EQ(load_placed_groom(options)->placement.unit_m, 0.5f);
  // Parts of one head of hair are brought into the first one's unit.
  options.unit_m = 0.0f;
  std::string metres = stage(kLines);
  metres.replace(metres.find("0.01"), 4, "1.00");
  options.more_paths = {folder.write("brows.usda", metres)};
  const auto both = load_placed_groom(options);
  ASSERT_TRUE(both) << both.error().to_string();
  EXPECT_FLOAT_EQ(both->placement.unit_m, 0.01f);
  EXPECT_THAT(both->notes, Contains(AllOf(HasSubstr("brows.usda states another unit"), HasSubstr("by 100"))));
  EXPECT_FLOAT_EQ(both->groom.length_m(2), 100.0f * both->groom.length_m(0));
  // Two up axes are too many.
  std::string other_axis = stage(kLines);
  other_axis.replace(other_axis.find("\"Z\""), 3, "\"Y\"");
  options.more_paths = {folder.write("brows.usda", other_axis)};
  EXPECT_THAT(load_placed_groom(options).error().to_string(),
              AllOf(HasSubstr("brows.usda"), HasSubstr("another up axis")));
}

TEST(Usda, TransformsAreThoseOfUsd) {
  expect_near(points_with("double3 xformOp:translate = (1, 2, 3)\nuniform token[] xformOpOrder = "
                          "[\"xformOp:translate\"]\n"),
              {{1, 2, 3}, {1, 2, 4}, {1, 3, 5.5f}, {2, 2, 3}, {2, 2, 2}});
  // The last op comes first: scaled, then moved.
  expect_near(points_with("double3 xformOp:translate = (1, 0, 0)\nfloat3 xformOp:scale = (2, 1, 10)\n"
                          "uniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:scale\"]\n"),
              {{1, 0, 0}, {1, 0, 10}, {1, 1, 25}, {3, 0, 0}, {3, 0, -10}});
  // About X first: +Z becomes -Y, and about Z that becomes +X.
  expect_near(points_with("float3 xformOp:rotateXYZ = (90, 0, 90)\n"
                          "uniform token[] xformOpOrder = [\"xformOp:rotateXYZ\"]\n"),
              {{0, 0, 0}, {1, 0, 0}, {2.5f, 0, 1}, {0, 1, 0}, {-1, 1, 0}});
  // A row is what USD multiplies a row vector with: the last one moves.
  expect_near(
      points_with("matrix4d xformOp:transform = ( (0, 1, 0, 0), (-1, 0, 0, 0), (0, 0, 1, 0), (5, 6, 7, 1) )\n"
                  "uniform token[] xformOpOrder = [\"xformOp:transform\"]\n"),
      {{5, 6, 7}, {5, 6, 8}, {4, 6, 9.5f}, {5, 7, 7}, {5, 7, 6}});
  // Around a pivot, and of what is not in the order nothing counts.
  expect_near(
      points_with("double3 xformOp:translate = (9, 9, 9)\ndouble3 xformOp:translate:pivot = (1, 0, 0)\n"
                  "float xformOp:rotateZ = 180\nuniform token[] xformOpOrder = [\"xformOp:translate:pivot\", "
                  "\"xformOp:rotateZ\", \"!invert!xformOp:translate:pivot\"]\n"),
      {{2, 0, 0}, {2, 0, 1}, {2, -1, 2.5f}, {1, 0, 0}, {1, 0, -1}});
  expect_near(points_with("quatf xformOp:orient = (0, 0, 0, 1)\n"
                          "uniform token[] xformOpOrder = [\"xformOp:orient\"]\n"),
              {{0, 0, 0}, {0, 0, 1}, {0, -1, 2.5f}, {-1, 0, 0}, {-1, 0, -1}});
  // Of samples the first.
  expect_near(points_with("double3 xformOp:translate.timeSamples = { 3: (1, 0, 0), 4: (2, 0, 0), }\n"
                          "uniform token[] xformOpOrder = [\"xformOp:translate\"]\n"),
              {{1, 0, 0}, {1, 0, 1}, {1, 1, 2.5f}, {2, 0, 0}, {2, 0, -1}});
}

TEST(Usda, AStackIsResetByAPrimOfItsOwn) {
  const std::string moved =
      "double3 xformOp:translate = (1, 2, 3)\nuniform token[] xformOpOrder = "
      "[\"xformOp:translate\"]\n";
  const auto groom =
      read_usd(stage(kLines + "uniform token[] xformOpOrder = [\"!resetXformStack!\"]\n", moved));
  ASSERT_TRUE(groom) << groom.error().to_string();
  EXPECT_EQ(groom->groom.rest_position_m, kPoints);
}

TEST(Usda, PointsWithoutATimeGoBeforeTimeSamplesAndOfTheseTheFirst) {
  const std::string counts = "uniform token type = \"linear\"\nint[] curveVertexCounts = [2]\n";
  const std::string samples =
      "point3f[] points.timeSamples = {\n 7.5: [(0, 0, 0), (0, 0, 1)],\n 8: [(5, 5, 5)],\n}\n";
  const auto timed = read_usd(stage(counts + samples));
  ASSERT_TRUE(timed) << timed.error().to_string();
  EXPECT_EQ(timed->groom.rest_position_m[1], glm::vec3(0, 0, 1));
  EXPECT_THAT(timed->notes, Contains(HasSubstr("time code 7.5, the first")));
  const std::string still = "point3f[] points = [(1, 1, 1), (2, 2, 2)]\n";
  for (const std::string& both : {samples + still, still + samples}) {
    const auto groom = read_usd(stage(counts + both));
    ASSERT_TRUE(groom) << groom.error().to_string();
    EXPECT_EQ(groom->groom.rest_position_m[1], glm::vec3(2, 2, 2));
  }
}

TEST(Usda, CubicCurvesBecomePointsOnThem) {
  // A Bezier curve of x = t, y = t^2 - t^3 by its control points.
  const auto bezier =
      points_on_curve(std::vector<glm::vec3>{{0, 0, 0}, {1 / 3.0f, 0, 0}, {2 / 3.0f, 1 / 3.0f, 0}, {1, 0, 0}},
                      CurveBasis::Bezier, CurveEnds::Open);
  ASSERT_TRUE(bezier) << bezier.error().to_string();
  for (size_t i = 0; i < 4; ++i) {
    const float t = static_cast<float>(i) / 3.0f;
    EXPECT_LT(glm::distance((*bezier)[i], glm::vec3(t, t * t - t * t * t, 0)), 1e-6f) << i;
  }
  // Evenly spaced control points of a B-spline or Catmull-Rom curve give the line that they are on; open ones
  // run from the second to the last but one.
  std::vector<glm::vec3> line;
  for (int i = 0; i < 8; ++i) line.emplace_back(static_cast<float>(i), 0, 1);
  for (const CurveBasis basis : {CurveBasis::BSpline, CurveBasis::CatmullRom}) {
    const auto open = points_on_curve(line, basis, CurveEnds::Open);
    const auto pinned = points_on_curve(line, basis, CurveEnds::Pinned);
    ASSERT_TRUE(open && pinned);
    for (size_t i = 0; i < 8; ++i) {
      EXPECT_LT(glm::distance((*open)[i], glm::vec3(1.0f + 5.0f * static_cast<float>(i) / 7.0f, 0, 1)),
                1e-5f);
      EXPECT_LT(glm::distance((*pinned)[i], line[i]), 1e-5f);
    }
  }
  // A Catmull-Rom curve goes through its inner points, a B-spline past them: at a knot by 1/6, 4/6, 1/6.
  const std::vector<glm::vec3> bent = {{0, 0, 0}, {1, 3, 0}, {2, 0, 0}, {3, 3, 0}};
  EXPECT_LT(glm::distance(points_on_curve(bent, CurveBasis::CatmullRom, CurveEnds::Open)->front(), bent[1]),
            1e-6f);
  EXPECT_LT(
      glm::distance(points_on_curve(bent, CurveBasis::BSpline, CurveEnds::Open)->front(), glm::vec3(1, 2, 0)),
      1e-6f);
  EXPECT_LT(glm::distance(points_on_curve(bent, CurveBasis::BSpline, CurveEnds::Pinned)->front(), bent[0]),
            1e-6f);
  EXPECT_FALSE(points_on_curve(line, CurveBasis::Bezier, CurveEnds::Open)) << "8 is not 3 n + 1";
  EXPECT_FALSE(points_on_curve(std::span(line).first(3), CurveBasis::BSpline, CurveEnds::Open));
}

TEST(Usda, CubicCurvesAreSaidToHaveBecomePoints) {
  const auto groom =
      read_usd(stage("uniform token type = \"cubic\"\nuniform token basis = \"bspline\"\n"
                     "uniform token wrap = \"pinned\"\nint[] curveVertexCounts = [4]\n"
                     "point3f[] points = [(0,0,0), (0,0,1), (0,0,2), (0,0,3)]\n"));
  ASSERT_TRUE(groom) << groom.error().to_string();
  EXPECT_EQ(groom->groom.uniform_vertex_count(), 4u);
  EXPECT_THAT(groom->notes,
              Contains(HasSubstr("1 cubic curve (bspline) became as many points on each curve")));
}

TEST(Usda, SeveralPrimsAreOneGroomAndWhatDoesNotCountIsLeftOut) {
  const std::string curves = "BasisCurves \"Hair\"\n{\n" + kLines +
                             "float[] widths = [0.1, 0.02] (\n interpolation = "
                             "\"vertex\"\n)\n}\n";
  const std::string text = "#usda 1.0\n\ndef " + curves + "class " + curves + "over " + curves +
                           "def Scope \"Off\" ( active = false )\n{\n def " + curves + "}\n" +
                           "def Xform \"Gone\" {\n token visibility = \"invisible\"\n def " + curves + "}\n" +
                           "def NurbsCurves \"n\" {}\ndef \"refers\" ( prepend references = "
                           "@other.usda@</Hair> (offset = 1) ) {}\n"
                           "def Xform \"In\" { custom rel prop = </Hair>\n reorder nameChildren = [\"a\"]\n"
                           "variantSet \"v\" = { \"one\" { def " +
                           curves +
                           "} }\n token outputs:surface\n"
                           "dictionary d = { string s = \"}\" }\n def " +
                           curves + "}\n";
  const auto groom = read_usd(text);
  ASSERT_TRUE(groom) << groom.error().to_string();
  EXPECT_EQ(groom->groom.strand_count(), 4u);
  EXPECT_FALSE(groom->unit_m || groom->is_z_up) << "nothing is stated, so both are guessed as of any file";
  EXPECT_THAT(groom->notes, Contains(HasSubstr("strands of 2 BasisCurves")));
  EXPECT_THAT(groom->notes, Contains(HasSubstr("4 BasisCurves are left out")));
  EXPECT_THAT(groom->notes, Contains(HasSubstr("2 references, layers or variants are not followed")));
  EXPECT_THAT(groom->notes, Contains(HasSubstr("1 NurbsCurves or HermiteCurves is not read")));
  EXPECT_THAT(groom->notes, Contains(HasSubstr("widths of 0.02 to 0.1 units are kept for exports")));
}

TEST(Usda, WhatTheFileSaysOfStrandsIsKeptWhereItFits) {
  const std::string ids = "int[] primvars:groom_id = [7, -3]\n";
  const std::string more =
      "int[] primvars:groom_group_id = [4, 5]\nfloat[] widths = [0.1, 0.2]\n"
      "texCoord2f[] primvars:groom_root_uv = [(0.1, 0.2), (0.3, 0.4)]\n";
  const auto hair = read_usd(stage(kLines + ids + more,
                                   "double3 xformOp:scale = (2, 2, 2)\nuniform token[] "
                                   "xformOpOrder = [\"xformOp:scale\"]\n"));
  ASSERT_TRUE(hair) << hair.error().to_string();
  EXPECT_EQ(hair->labels.id, (std::vector<int32_t>{7, -3}));
  EXPECT_EQ(hair->labels.group, (std::vector<int32_t>{4, 5}));
  EXPECT_EQ(hair->labels.width, (std::vector<float>{0.2f, 0.2f, 0.2f, 0.4f, 0.4f})) << "as large as the hair";
  EXPECT_EQ(hair->groom.root_uv, (std::vector<glm::vec2>{{0.1f, 0.2f}, {0.3f, 0.4f}}));
  EXPECT_EQ(hair->labels.object_name, std::vector<std::string>{"Hair"});
  // Who lacks an id gets a further one, and a list that fits nothing says nothing.
  const std::string other = "def BasisCurves \"Other\" {\n" + kLines + more + "}\n";
  const auto two = read_usd(stage(kLines + ids + more) + other);
  ASSERT_TRUE(two) << two.error().to_string();
  EXPECT_EQ(two->labels.id, (std::vector<int32_t>{7, -3, 8, 9}));
  EXPECT_EQ(two->labels.group, (std::vector<int32_t>{4, 5, 4, 5}));
  EXPECT_EQ(two->labels.object, (std::vector<uint32_t>{0, 0, 1, 1}));
  const auto unfit = read_usd(stage(kLines + "int[] primvars:groom_id = [7]\nfloat[] widths = [1, 2, 3]\n"));
  ASSERT_TRUE(unfit) << unfit.error().to_string();
  EXPECT_TRUE(unfit->labels.id.empty() && unfit->labels.width.empty());
  // One for each point may be more than there can be strands.
  std::string many = "float[] primvars:groom_id = [1";
  for (uint32_t i = 0; i <= 2 * kMaxStrandCount; ++i) many += ",1";
  EXPECT_EQ(refusal(stage(kLines + many + "]\n")), "accepted");
}

TEST(Usda, CurvesWithoutASegmentAreLeftOutAndCounted) {
  const std::string head = "uniform token type = \"linear\"\nint[] curveVertexCounts = [2, 1, 2]\n";
  const std::string points = "point3f[] points = [(0, 0, 0), (0, 0, 1), (5, 5, 5), (1, 0, 0), (1, 0, -1)]\n";
  const auto hair = read_usd(stage(head + points +
                                   "int[] primvars:groom_id = [1, 2, 3]\n"
                                   "float[] widths = [0.1, 0.2, 0.3, 0.4, 0.5]\n"));
  ASSERT_TRUE(hair) << hair.error().to_string();
  EXPECT_EQ(hair->groom.offset, (std::vector<uint32_t>{0, 2, 4}));
  EXPECT_EQ(hair->groom.rest_position_m,
            (std::vector<glm::vec3>{{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {1, 0, -1}}));
  EXPECT_EQ(hair->labels.id, (std::vector<int32_t>{1, 3}));
  EXPECT_EQ(hair->labels.width, (std::vector<float>{0.1f, 0.2f, 0.4f, 0.5f}));
  EXPECT_THAT(hair->notes, Contains(HasSubstr("1 of 3 strands cannot be used")));
}

TEST(Usda, GuidesAreNoHairUnlessAllAre) {
  const auto read_with = [](const std::string& body) {
    auto hair = read_usd(stage(kLines + body));
    EXPECT_TRUE(hair) << hair.error().to_string();
    return std::move(hair).value();
  };
  const StatedGroom mixed =
      read_with("int[] primvars:groom_guide = [0, 1]\nint[] primvars:groom_id = [7, 8]\n");
  EXPECT_EQ(mixed.groom.offset, (std::vector<uint32_t>{0, 3}));
  EXPECT_EQ(mixed.labels.id, std::vector<int32_t>{7});
  EXPECT_THAT(mixed.notes, Contains(HasSubstr("1 guide is left out")));
  const auto alone = read_usd(stage(kLines + "int[] primvars:groom_guide = [0, 1]\n"), GuideUse::Alone);
  ASSERT_TRUE(alone) << alone.error().to_string();
  EXPECT_EQ(alone->groom.strand_count(), 1u);
  EXPECT_NE(alone->groom.rest_position_m, mixed.groom.rest_position_m);
  EXPECT_THAT(alone->notes, Contains(HasSubstr("1 guide is the hair")));
  for (const char* const all : {"int[] primvars:groom_guide = [1, 1]\n", "int primvars:groom_guide = 1\n",
                                "uniform token purpose = \"guide\"\n"}) {
    const StatedGroom guides = read_with(all);
    EXPECT_EQ(guides.groom.strand_count(), 2u) << all;
    EXPECT_THAT(guides.notes, Contains("all strands are guides: they are taken as hair")) << all;
  }
}

TEST(Usda, GuidesThatLackWhatHairSaysTakeNothingFromIt) {
  const std::string said =
      "int[] primvars:groom_id = [7, 8]\nint[] primvars:groom_group_id = [1, 2]\ntexCoord2f[] "
      "primvars:groom_root_uv = [(0.1, 0.2), (0.3, 0.4)]\nfloat[] widths = [0.5]\n";
  const auto read_with = [&](const char* purpose) {
    auto hair = read_usd("#usda 1.0\ndef BasisCurves \"Hair\"\n{\n" + kLines + said +
                         "}\ndef BasisCurves \"Guides\"\n{\nuniform token purpose = \"" + purpose + "\"\n" +
                         kLines + "}\n");
    EXPECT_TRUE(hair) << hair.error().to_string();
    return std::move(hair).value();
  };
  const StatedGroom hair = read_with("guide");
  EXPECT_EQ(hair.groom.strand_count(), 2u);
  EXPECT_EQ(hair.labels.id, (std::vector<int32_t>{7, 8}));
  EXPECT_EQ(hair.labels.group, (std::vector<int32_t>{1, 2}));
  EXPECT_EQ(hair.labels.width, std::vector<float>(5, 0.5f));
  EXPECT_EQ(hair.groom.root_uv, (std::vector<glm::vec2>{{0.1f, 0.2f}, {0.3f, 0.4f}}));
  const StatedGroom more = read_with("render");
  EXPECT_EQ(more.groom.strand_count(), 4u);
  EXPECT_EQ(more.labels.id, (std::vector<int32_t>{7, 8, 9, 10}));
  EXPECT_EQ(more.labels.group, (std::vector<int32_t>{1, 2, 3, 3}));
  EXPECT_EQ(more.labels.width, std::vector<float>(10, 0.5f));
  EXPECT_EQ(more.groom.root_uv.size(), 4u);
  EXPECT_THAT(more.notes, Contains(HasSubstr("2 of 4 strands lack an id, a group, widths or root coord")));
  EXPECT_THAT(hair.notes, testing::Not(Contains(HasSubstr("strands lack"))));
}

// What a prim is for goes on to what is in it, unless that says another thing.
TEST(Usda, ProxiesAreLeftOutAndGuidesKnownByWhatIsAroundThem) {
  const auto prim = [](const std::string& purpose, const std::string& inside) {
    return "def Xform \"Group\"\n{\nuniform token purpose = \"" + purpose + "\"\n" + inside + "}\n";
  };
  const auto curves = [](const std::string& more) {
    return "def BasisCurves \"Hair\"\n{\n" + more + kLines + "}\n";
  };
  const std::string plain = "#usda 1.0\n" + curves("");
  const auto read_whole = [](const std::string& text) {
    auto hair = read_usd(text);
    EXPECT_TRUE(hair) << hair.error().to_string();
    return std::move(hair).value();
  };
  const StatedGroom proxy = read_whole(plain + prim("proxy", curves("")));
  EXPECT_EQ(proxy.groom.strand_count(), 2u);
  EXPECT_THAT(proxy.notes, Contains(HasSubstr("1 BasisCurves is left out: inactive, invisible, a proxy")));
  const StatedGroom own = read_whole(plain + prim("proxy", curves("uniform token purpose = \"render\"\n")));
  EXPECT_EQ(own.groom.strand_count(), 4u) << "says another thing";
  const StatedGroom guides = read_whole(plain + prim("guide", curves("")));
  EXPECT_EQ(guides.groom.strand_count(), 2u);
  EXPECT_THAT(guides.notes, Contains(HasSubstr("2 guides are left out")));
}

TEST(Usda, InstancersAreLeftOutAndCounted) {
  const std::string instancer =
      "def PointInstancer \"Tufts\"\n{\nint[] protoIndices = [0, 0, 0]\npoint3f[] positions = [(0, 0, 0), "
      "(1, "
      "0, 0), (2, 0, 0)]\ndef BasisCurves \"Tuft\"\n{\n" +
      kLines + "}\n}\n";
  const auto beside = read_usd(stage(kLines) + instancer);
  ASSERT_TRUE(beside) << beside.error().to_string();
  EXPECT_EQ(beside->groom.rest_position_m, kPoints) << "what is in one is not drawn by itself";
  EXPECT_THAT(beside->notes, Contains(HasSubstr("1 PointInstancer with 3 instances are left out")));
  EXPECT_THAT(refusal("#usda 1.0\n" + instancer),
              AllOf(HasSubstr("no BasisCurves to read"), HasSubstr("1 PointInstancer with 3 instances"),
                    HasSubstr("make the instances curves")));
}

TEST(Usda, MotionOfATransformAndWidthsThatFitNothingAreNamed) {
  const auto notes_of = [](const std::string& body, const std::string& around) {
    const auto hair = read_usd(stage(kLines + body, around));
    EXPECT_TRUE(hair) << hair.error().to_string();
    return hair ? hair->notes : std::vector<std::string>();
  };
  const std::string moving =
      "double3 xformOp:translate.timeSamples = { 0: (1, 2, 3), 1: (4, 2, 3) }\n"
      "uniform token[] xformOpOrder = [\"xformOp:translate\"]\n";
  const auto says_motion = Contains(HasSubstr("1 BasisCurves stands as its first transform has it"));
  EXPECT_THAT(notes_of("", moving), says_motion);
  EXPECT_THAT(notes_of("", "double3 xformOp:translate = (1, 2, 3)\n"), testing::Not(says_motion));
  const auto says_widths = Contains(HasSubstr("widths of 1 BasisCurves are negative or fit nothing"));
  EXPECT_THAT(notes_of("float[] widths = [1, 2, 3, 4]\n", ""), says_widths);
  EXPECT_THAT(notes_of("float[] widths = [-1]\n", ""), says_widths);
  EXPECT_THAT(notes_of("float[] widths = [1]\n", ""), testing::Not(says_widths));
}

// A hair of 0.08 mm in a file of centimetres and grams: 3e9 Pa are 3e10 g / (cm s^2), 1300 kg/m^3 1.3 g/cm^3.
TEST(Usda, WhatHairIsMadeOfIsReadInItsUnits) {
  const auto with = [](const std::string& material, const std::string& body) {
    return stage(kLines + body, "def Material \"Keratin\"\n{\n" + material + "}\n",
                 "kilogramsPerUnit = 0.001\n");
  };
  const std::string keratin =
      "float physics:youngsModulus = 3e10\nfloat physics:density = 1.3\nfloat physics:poissonsRatio = 0.4\n";
  const TemporaryFolder folder;
  const auto made_of = [&](const std::string& text) {
    GroomFileOptions options;
    options.path = folder.write("hair.usda", text);
    auto placed = load_placed_groom(options);
    EXPECT_TRUE(placed) << placed.error().to_string();
    return std::move(placed).value();
  };
  for (const std::string thickness :
       {"float physics:thickness = 0.008\n", "float physics:curvesThickness = 0.008\n",
        "float omniphysics:thickness = 0.008\n"}) {
    const PlacedGroom placed = made_of(with(keratin + thickness, ""));
    EXPECT_NEAR(placed.material.diameter.value_or(0.0), 8e-5, 1e-11);
    EXPECT_NEAR(placed.material.young_modulus.value_or(0.0), 3e9, 1e3);
    EXPECT_NEAR(placed.material.density.value_or(0.0), 1300.0, 1e-3);
    EXPECT_EQ(placed.material.poisson_ratio, 0.4);
    EXPECT_THAT(placed.notes, Contains(HasSubstr("it is made of: diameter in m 8e-05")));
  }
  EXPECT_NEAR(*made_of(with(keratin, "float[] physics:thicknesses = [0.006, 0.01]\n")).material.diameter,
              8e-5, 1e-11);
  EXPECT_NEAR(*made_of(with("float physics:bendStiffness = 3e10\n", "")).material.young_modulus, 3e9, 1e3);
  // What stands for "not said", what no strand is made of, and what is no hair's.
  const PlacedGroom silent = made_of(with(
      "float physics:youngsModulus = -inf\nfloat physics:thickness = 50\nfloat physics:density = 0\n", ""));
  EXPECT_FALSE(silent.material.is_known());
  EXPECT_THAT(silent.notes, Contains(HasSubstr("its diameter in m 0.5 is left out")));
  EXPECT_FALSE(made_of(with("float physics:density = 1.3\n", "")).material.is_known());
}

TEST(Usda, TheRestShapeOfCurvePhysicsIsTheHairWhereItsRootsAre) {
  const auto with = [](const std::string& rest) {
    return read_usd(stage(kLines + "point3f[] physics:restShapePoints = " + rest + "\n"));
  };
  const auto in_place = with("[(0, 0, 0), (0, 0, 2), (0, 0, 3), (1, 0, 0), (1, 0, -2)]");
  ASSERT_TRUE(in_place) << in_place.error().to_string();
  EXPECT_EQ(in_place->groom.rest_position_m[2], glm::vec3(0, 0, 3));
  for (const char* const rest :
       {"[(9, 0, 0), (9, 0, 2), (9, 0, 3), (1, 0, 0), (1, 0, -2)]", "[(0, 0, 0), (0, 0, 2)]"}) {
    const auto elsewhere = with(rest);
    ASSERT_TRUE(elsewhere) << elsewhere.error().to_string();
    EXPECT_EQ(elsewhere->groom.rest_position_m, kPoints);
    EXPECT_THAT(elsewhere->notes, Contains(HasSubstr("points are the hair")));
  }
}

TEST(Usda, GroupsHaveTheNamesThatTheFileSays) {
  const auto names_with = [](const std::string& body) {
    const auto hair = read_usd(stage(kLines + body));
    EXPECT_TRUE(hair) << hair.error().to_string();
    std::vector<std::string> names;
    for (const uint32_t object : hair->labels.object) names.push_back(hair->labels.object_name[object]);
    return names;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(names_with(""), (Names{"Hair", "Hair"})) << "the prim's own";
  EXPECT_EQ(names_with("string[] primvars:groom_group_name = [\"bangs\", \"back\"]\n"),
            (Names{"bangs", "back"}));
  EXPECT_EQ(names_with("string primvars:groom_group_name = \"bangs\"\n"), (Names{"bangs", "bangs"}));
  const std::string indexed = "string[] primvars:groom_group_name = [\"a\", \"b\"]\nint[] ";
  EXPECT_EQ(names_with(indexed + "primvars:groom_group_name:indices = [1, 0]\n"), (Names{"b", "a"}));
  EXPECT_EQ(names_with(indexed + "primvars:groom_group_name:indices = [1, 9]\n"), (Names{"Hair", "Hair"}));
}

TEST(Usda, AnUpAxisMayBeWrittenSmall) {
  const auto hair =
      read_usd("#usda 1.0\n(\n    upAxis = \"z\"\n)\ndef BasisCurves \"Hair\" {\n" + kLines + "}\n");
  ASSERT_TRUE(hair) << hair.error().to_string();
  EXPECT_EQ(hair->is_z_up, true);
}

TEST(Usda, AnAxisOrUnitThatIsNoneIsLeftOutAndNamed) {
  for (const auto& [said, note] : {std::pair("upAxis = \"X\"\n", "its upAxis is 'X'"),
                                   {"metersPerUnit = 0\n", "its metersPerUnit is 0"},
                                   {"metersPerUnit = -inf\n", "its metersPerUnit is -inf"}}) {
    const auto groom =
        read_usd(fmt::format("#usda 1.0\n(\n    {})\ndef BasisCurves \"Hair\" {{\n{}}}\n", said, kLines));
    ASSERT_TRUE(groom) << groom.error().to_string();
    EXPECT_FALSE(groom->unit_m || groom->is_z_up);
    EXPECT_THAT(groom->notes, Contains(HasSubstr(note)));
  }
}

TEST(Usda, AUnitThatFitsNoHeadIsSaid) {
  const TemporaryFolder folder;
  const auto told_with = [&](const char* unit) {
    const std::string text = fmt::format(
        "#usda 1.0\n(\n    metersPerUnit = {}\n)\ndef BasisCurves \"Hair\" {{\n{}}}\n", unit, kLines);
    GroomFileOptions options;
    options.path = folder.path() / "hair.usda";
    EXPECT_TRUE(save_file(options.path, std::as_bytes(std::span(text))));
    const auto placed = load_placed_groom(options);
    EXPECT_TRUE(placed) << placed.error().to_string();
    return placed ? placed->unlikely : "";
  };
  // The hair is 3.5 units long.
  EXPECT_THAT(told_with("0.001"), AllOf(HasSubstr("3.5 mm long"), HasSubstr("groom.file.unit_m=1 makes")));
  EXPECT_EQ(told_with("1"), "");
}

TEST(Usda, WhatIsWrongIsNamedWithItsLine) {
  EXPECT_THAT(refusal("#usd"), HasSubstr("does not begin with '#usda 1.0'"));
  EXPECT_THAT(refusal("#usda 1.0\n"), HasSubstr("no BasisCurves"));
  EXPECT_THAT(refusal("#usda 1.0\ndef \"a\" ( references = @b.usda@ ) {}\n"), HasSubstr("usdcat --flatten"));
  EXPECT_THAT(refusal(stage("int[] curveVertexCounts = [2]\npoint3f[] points = [(0, 0, 0), (0, 0]\n")),
              HasSubstr("line 16: ']' found where ')' is needed"));
  EXPECT_THAT(
      refusal(stage("uniform token type = \"linear\"\nint[] curveVertexCounts = [2]\npoint3f[] points = "
                    "[(0, 0, 0)]\n")),
      AllOf(HasSubstr("prim 'Hair'"), HasSubstr("need 2 points, there are 1")));
  EXPECT_THAT(refusal(stage("int[] curveVertexCounts = [1]\npoint3f[] points = [(0, 0, 0)]\n")),
              HasSubstr("no strand has 2 points and a length"));
  EXPECT_THAT(refusal(stage(kLines + "uniform token wrap = \"periodic\"\n")), HasSubstr("closed curves"));
  EXPECT_THAT(refusal(stage(kLines + "uniform token type = \"wavy\"\n")), HasSubstr("type is 'wavy'"));
  EXPECT_THAT(refusal(stage(kLines, "uniform token[] xformOpOrder = [\"xformOp:bend\"]\n")),
              HasSubstr("names the transform 'xformOp:bend'"));
  std::string deep = "#usda 1.0\n";
  for (int i = 0; i < 100; ++i) deep += "def \"a\" {\n";
  EXPECT_THAT(refusal(deep), HasSubstr("prims in each other"));
  EXPECT_THAT(refusal("#usda 1.0\ndef \"a\" { int[] a = " + std::string(100, '[')),
              HasSubstr("too many brackets"));
}

TEST(Usda, ATruncationIsRefusedThatLeavesAPointOut) {
  const std::string whole =
      stage(kLines + "float[] widths = [1]\n", "double3 xformOp:translate = (1, 2, 3)\n");
  const size_t points_end = whole.find("]\n", whole.find("points ="));
  for (size_t size = 0; size + 2 < whole.size(); ++size)
    ASSERT_EQ(refusal(whole.substr(0, size)) == "accepted", size > points_end)
        << size << " bytes of " << whole.size();
  EXPECT_EQ(refusal(whole), "accepted");
}

}  // namespace
}  // namespace strandcast::groom_usda_test

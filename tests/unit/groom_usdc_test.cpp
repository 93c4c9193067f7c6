// Strands in binary and packed USD: the same stage as text gives, by every way that the format has to say it,
// and a sentence for what is damaged.
#include <cmath>
#include <random>

#include "client/export/export_strands.h"
#include "common/groom/groom_file.h"
#include "common/groom/usd_loader.h"
#include "common/groom/usd_stage.h"
#include "common/groom/usdc_archive.h"
#include "common/groom/usdc_coding.h"
#include "tests/fuzz/groom_checks.h"
#include "tests/support/largest_allocation.h"
#include "tests/support/made_states.h"
#include "tests/support/made_usdc.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::groom_usdc_test {
namespace {

using test::literal_block;
using test::MadeSpec;
using test::MadeUsdc;
using test::raw_bytes;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text));
}
std::string text_of(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}
std::string refusal(const std::string& file) {
  const auto groom = read_usd(file);
  return groom ? "accepted" : groom.error().to_string();
}
const std::vector<glm::vec3> kPoints = {{0, 0, 0}, {0, 0, 1}, {0, 1, 2.5f}, {1, 0, 0}, {1, 0, -1}};

std::vector<MadeSpec> line_items(MadeUsdc& file) {
  return {MadeUsdc::attribute("type", file.token("linear")),
          MadeUsdc::attribute("curveVertexCounts", file.ints({3, 2})),
          MadeUsdc::attribute("points", file.array(24, kPoints.size(), raw_bytes(kPoints)))};
}
/// A stage with one prim of two lines in a transform, and with `more` properties of it.
std::string lines(MadeUsdc& file, std::vector<MadeSpec> more = {}, std::vector<MadeSpec> xform = {}) {
  std::vector<MadeSpec> items = line_items(file);
  items.insert(items.end(), more.begin(), more.end());
  xform.push_back(file.prim("Hair", "BasisCurves", std::move(items)));
  const uint64_t centimetre = file.scalar(9, raw_bytes(std::vector<double>{0.01}));
  return file.finish({file.prim("Head", "Xform", std::move(xform))},
                     {{"metersPerUnit", centimetre}, {"upAxis", file.token("Z")}});
}

TEST(UsdcCoding, BlocksAreThoseOfLz4) {
  // Three literals and 15 bytes from 3 back, then five literals: "abc" six times and "hello".
  const std::string packed = std::string("\0\x3b", 2) + "abc" + std::string("\x03\0\x50", 3) + "hello";
  const auto plain = unpack_usdc_bytes(bytes_of(packed), 100);
  ASSERT_TRUE(plain) << plain.error().to_string();
  EXPECT_EQ(text_of(*plain), "abcabcabcabcabcabchello");
  EXPECT_FALSE(unpack_usdc_bytes(bytes_of(packed), 22)) << "it makes 23";
  for (size_t size = 0; size < packed.size(); ++size)
    EXPECT_FALSE(size != 5 && unpack_usdc_bytes(bytes_of(packed.substr(0, size)), 100)) << size;
  std::string far = packed;
  far[5] = 4;
  EXPECT_FALSE(unpack_usdc_bytes(bytes_of(far), 100)) << "a match from before the beginning";
  // Two blocks, each behind its size.
  const std::string two = std::string("\2\4\0\0\0\x30", 6) + "abc" + std::string("\3\0\0\0\x20", 5) + "de";
  EXPECT_EQ(text_of(*unpack_usdc_bytes(bytes_of(two), 100)), "abcde");
}

TEST(UsdcCoding, WhatIsPackedComesBack) {
  std::mt19937 random(7);
  for (const size_t size : {0, 1, 11, 12, 13, 14, 15, 16, 19, 20, 270, 300, 5'000, 200'000}) {
    for (const int kinds : {1, 2, 256}) {
      std::string plain;
      for (size_t i = 0; i < size; ++i) plain += static_cast<char>(static_cast<int>(random() >> 8) % kinds);
      const std::string packed = pack_usdc_bytes(bytes_of(plain));
      const auto back = unpack_usdc_bytes(bytes_of(packed), size);
      ASSERT_TRUE(back) << back.error().to_string();
      EXPECT_EQ(text_of(*back), plain);
      EXPECT_EQ(text_of(*unpack_usdc_bytes(bytes_of(literal_block(plain)), size)), plain);
      if (size < 5'000) continue;
      EXPECT_TRUE(kinds != 1 || packed.size() < size / 100) << packed.size();
      EXPECT_TRUE(kinds != 256 || packed.size() > size) << "chance has no repeats";
    }
  }
}

TEST(UsdcCoding, IntegersAreCodedInTwoBitsAndUpToFourBytes) {
  // Differences 1 (common), 1, 1, 100 (one byte), 1000 (two), 100000 (four), -100.
  const std::vector<int32_t> numbers = {1, 2, 3, 103, 1'103, 101'103, 101'003};
  const std::string coded("\1\0\0\0\x40\x1e\x64\xe8\x03\xa0\x86\x01\0\x9c", 14);
  const auto plain = unpack_usdc_ints(bytes_of(literal_block(coded)), numbers.size());
  ASSERT_TRUE(plain) << plain.error().to_string();
  EXPECT_EQ(*plain, numbers);
  EXPECT_EQ(text_of(*unpack_usdc_bytes(bytes_of(pack_usdc_ints(numbers)), 100)), coded);
  for (size_t size = 0; size < coded.size(); ++size)
    EXPECT_FALSE(unpack_usdc_ints(bytes_of(literal_block(coded.substr(0, size))), numbers.size())) << size;
  std::mt19937 random(7);
  for (const size_t count : {0, 1, 2, 3, 4, 5, 1'000}) {
    std::vector<int32_t> wild;
    for (size_t i = 0; i < count; ++i) wild.push_back(static_cast<int32_t>(random() >> random() % 32));
    EXPECT_EQ(*unpack_usdc_ints(bytes_of(pack_usdc_ints(wild)), count), wild);
  }
}

TEST(Usdc, ReadsLinesWithUnitAndUpAxis) {
  MadeUsdc file;
  const auto groom = read_usd(lines(file));
  ASSERT_TRUE(groom) << groom.error().to_string();
  EXPECT_EQ(groom->groom.offset, (std::vector<uint32_t>{0, 3, 5}));
  EXPECT_EQ(groom->groom.rest_position_m, kPoints);
  EXPECT_EQ(groom->groom.pinned, (std::vector<uint8_t>{1, 0, 0, 1, 0}));
  EXPECT_EQ(groom->unit_m, 0.01f);
  EXPECT_EQ(groom->is_z_up, true);
}

/// The specs that state what a prim of a stage is, with all that is in it.
MadeSpec made_prim(MadeUsdc& file, const UsdStage& stage, size_t index, size_t& others) {
  const UsdPrim& prim = stage.prim[index];
  std::vector<MadeSpec> items;
  for (const UsdXformOp& op : prim.op) {
    std::vector<double> value = op.value;
    if (value.size() == 4) std::rotate(value.begin(), value.begin() + 1, value.end());
    const int type = value.size() == 1 ? 9 : value.size() == 3 ? 23 : value.size() == 4 ? 16 : 15;
    items.push_back(MadeUsdc::attribute(op.name, file.scalar(type, raw_bytes(value))));
  }
  if (!prim.op_order.empty())
    items.push_back(MadeUsdc::attribute("xformOpOrder", file.tokens(prim.op_order)));
  std::string type = others > 0 && !prim.curves ? "NurbsCurves" : "Xform";
  if (type == "NurbsCurves") --others;
  if (prim.curves) {
    const UsdCurves& curves = *prim.curves;
    type = "BasisCurves";
    const uint64_t points = file.array(24, curves.points.size(), raw_bytes(curves.points));
    items.push_back(curves.time_code
                        ? MadeUsdc::moving("points", file.samples({*curves.time_code, 1e6},
                                                                  {points, MadeUsdc::rep(51, 0)}))
                        : MadeUsdc::attribute("points", points));
    items.push_back(MadeUsdc::attribute(
        "curveVertexCounts", file.ints({curves.vertex_counts.begin(), curves.vertex_counts.end()})));
    items.push_back(
        MadeUsdc::attribute("widths", file.array(8, curves.widths.size(), raw_bytes(curves.widths))));
    const auto whole = [&](const std::vector<double>& numbers) {
      return file.ints({numbers.begin(), numbers.end()});
    };
    const std::vector<float> uv(curves.root_uv.begin(), curves.root_uv.end());
    items.push_back(MadeUsdc::attribute("primvars:groom_id", whole(curves.ids)));
    items.push_back(MadeUsdc::attribute("primvars:groom_group_id", whole(curves.groups)));
    items.push_back(
        MadeUsdc::attribute("primvars:groom_root_uv", file.array(20, uv.size() / 2, raw_bytes(uv))));
    items.push_back(MadeUsdc::attribute("type", file.token(curves.type)));
    items.push_back(MadeUsdc::attribute("basis", file.token(curves.basis)));
    items.push_back(MadeUsdc::attribute("wrap", file.token(curves.wrap)));
  }
  for (size_t child = index + 1; child < stage.prim.size(); ++child)
    if (stage.prim[child].parent == index) items.push_back(made_prim(file, stage, child, others));
  MadeSpec made = file.prim(prim.name, type, std::move(items));
  if (prim.is_left_out) made.fields.emplace_back("active", MadeUsdc::inlined(1, 0));
  return made;
}

std::string binary_of(const UsdStage& stage) {
  MadeUsdc file;
  std::vector<std::pair<std::string, uint64_t>> layer;
  if (stage.meters_per_unit)
    layer.emplace_back("metersPerUnit",
                       file.scalar(9, raw_bytes(std::vector<double>{*stage.meters_per_unit})));
  if (stage.is_z_up) layer.emplace_back("upAxis", file.token(*stage.is_z_up ? "Z" : "Y"));
  const std::vector<std::string> variants(stage.reference_count, "v");
  if (!variants.empty()) layer.emplace_back("variantSetChildren", file.token_vector(variants));
  size_t others = stage.other_curve_count;
  std::vector<MadeSpec> prims;
  for (size_t i = 0; i < stage.prim.size(); ++i)
    if (!stage.prim[i].parent) prims.push_back(made_prim(file, stage, i, others));
  return file.finish(std::move(prims), std::move(layer));
}

void expect_same(const UsdStage& a, const UsdStage& b) {
  EXPECT_EQ(a.meters_per_unit, b.meters_per_unit);
  EXPECT_EQ(a.is_z_up, b.is_z_up);
  EXPECT_EQ(a.reference_count, b.reference_count);
  EXPECT_EQ(a.other_curve_count, b.other_curve_count);
  ASSERT_EQ(a.prim.size(), b.prim.size());
  for (size_t i = 0; i < a.prim.size(); ++i) {
    SCOPED_TRACE(a.prim[i].name);
    EXPECT_EQ(a.prim[i].name, b.prim[i].name);
    EXPECT_EQ(a.prim[i].parent, b.prim[i].parent);
    EXPECT_EQ(a.prim[i].is_left_out, b.prim[i].is_left_out);
    EXPECT_EQ(a.prim[i].op_order, b.prim[i].op_order);
    ASSERT_EQ(a.prim[i].op.size(), b.prim[i].op.size());
    for (const UsdXformOp& op : a.prim[i].op)
      EXPECT_TRUE(std::any_of(b.prim[i].op.begin(), b.prim[i].op.end(), [&](const UsdXformOp& same) {
        return same.name == op.name && same.value == op.value;
      })) << op.name;
    ASSERT_EQ(a.prim[i].curves.has_value(), b.prim[i].curves.has_value());
    if (!a.prim[i].curves) continue;
    const UsdCurves &one = *a.prim[i].curves, &other = *b.prim[i].curves;
    EXPECT_EQ(one.points, other.points);
    EXPECT_EQ(one.vertex_counts, other.vertex_counts);
    EXPECT_EQ(one.widths, other.widths);
    EXPECT_EQ(one.ids, other.ids);
    EXPECT_EQ(one.groups, other.groups);
    EXPECT_EQ(one.root_uv, other.root_uv);
    EXPECT_EQ(one.type, other.type);
    EXPECT_EQ(one.basis, other.basis);
    EXPECT_EQ(one.wrap, other.wrap);
    EXPECT_EQ(one.time_code, other.time_code);
  }
}

const std::string kRichText =
    "#usda 1.0\n( metersPerUnit = 0.025\n upAxis = \"Y\"\n subLayers = [@a.usd@] )\n"
    "def Xform \"Z first\" {\n double3 xformOp:translate:pivot = (1, 2.5, 3)\n float xformOp:rotateX = "
    "30.25\n"
    " quatf xformOp:orient = (0.5, 0.5, -0.5, 0.5)\n matrix4d xformOp:transform = "
    "((1,2,3,4),(5,6,7,8),(9,10,11,12),(13,14,15,16.125))\n"
    " uniform token[] xformOpOrder = [\"xformOp:translate:pivot\", \"xformOp:rotateX\", \"xformOp:orient\", "
    "\"xformOp:transform\", \"!invert!xformOp:translate:pivot\"]\n"
    " def BasisCurves \"b\" { uniform token type = \"cubic\" uniform token basis = \"catmullRom\" uniform "
    "token "
    "wrap = \"pinned\" int[] curveVertexCounts = [2, 3] float[] widths = [0.1, 0.25] "
    "int[] primvars:groom_id = [7, -3] int[] primvars:groom_group_id = [4, 5] "
    "texCoord2f[] primvars:groom_root_uv = [(0.25, 0.5), (0.75, 1)] "
    "point3f[] points.timeSamples = { -1.5: [(0,0,0), (0,0,1), (0,1,2), (1,0,0), (7,8,9.5)], 2: None, } }\n"
    " def NurbsCurves \"n\" {}\n}\n"
    "def Scope \"A second\" ( active = false ) { def \"x\" { def BasisCurves \"inner\" { int[] "
    "curveVertexCounts = "
    "[4] point3f[] points = [(0,0,0), (0,0,1), (0,1,2), (1,0,0)] } } def \"y\" ( references = @b.usd@ ) {} "
    "}\n";

TEST(Usdc, TextAndBinaryFillTheSameStageFieldByField) {
  const auto text = read_usda_stage(kRichText);
  ASSERT_TRUE(text) << text.error().to_string();
  ASSERT_EQ(text->prim.size(), 7u);
  ASSERT_EQ(text->reference_count, 2u);
  const std::string file = binary_of(*text);
  const auto binary = read_usdc_stage(std::make_shared<GroomSource>(bytes_of(file)));
  ASSERT_TRUE(binary) << binary.error().to_string();
  expect_same(*text, *binary);
}

TEST(Usdc, WhatTheFileSaysOfStrandsIsKeptWhereItFits) {
  const std::vector<float> widths = {0.1f, 0.2f, 0.3f, 0.4f, 0.5f};
  const std::vector<double> uv = {0.25, 0.5, 0.75, 1.0};
  MadeUsdc file;
  const auto hair = read_usd(
      lines(file, {MadeUsdc::attribute("primvars:groom_id", file.ints({7, -3})),
                   MadeUsdc::attribute("primvars:groom_group_id", file.array(8, 2, raw_bytes(widths))),
                   MadeUsdc::attribute("primvars:groom_root_uv", file.array(19, 2, raw_bytes(uv))),
                   MadeUsdc::attribute("widths", file.array(8, widths.size(), raw_bytes(widths)))}));
  ASSERT_TRUE(hair) << hair.error().to_string();
  EXPECT_EQ(hair->labels.id, (std::vector<int32_t>{7, -3}));
  EXPECT_EQ(hair->labels.group, (std::vector<int32_t>{0, 0}));
  EXPECT_EQ(hair->labels.width, widths);
  EXPECT_EQ(hair->groom.root_uv, (std::vector<glm::vec2>{{0.25f, 0.5f}, {0.75f, 1.0f}}));
  EXPECT_EQ(hair->labels.object_name, std::vector<std::string>{"Hair"});
  // A list of another type says nothing, and one value for all is no list.
  MadeUsdc other;
  const auto unfit =
      read_usd(lines(other, {MadeUsdc::attribute("primvars:groom_id", other.tokens({"a", "b"})),
                             MadeUsdc::attribute("primvars:groom_group_id", MadeUsdc::inlined(3, 5))}));
  ASSERT_TRUE(unfit) << unfit.error().to_string();
  EXPECT_TRUE(unfit->labels.id.empty() && unfit->labels.group.empty());
}

TEST(Usdc, CurvesWithoutASegmentAreLeftOutAndCounted) {
  MadeUsdc file;
  const auto hair =
      read_usd(file.finish({file.prim("Hair", "BasisCurves",
                                      {MadeUsdc::attribute("type", file.token("linear")),
                                       MadeUsdc::attribute("curveVertexCounts", file.ints({2, 1, 2})),
                                       MadeUsdc::attribute("points", file.array(24, 5, raw_bytes(kPoints))),
                                       MadeUsdc::attribute("primvars:groom_id", file.ints({1, 2, 3}))})},
                           {{"upAxis", file.token("z")}}));
  ASSERT_TRUE(hair) << hair.error().to_string();
  EXPECT_EQ(hair->groom.offset, (std::vector<uint32_t>{0, 2, 4}));
  EXPECT_EQ(hair->labels.id, (std::vector<int32_t>{1, 3}));
  EXPECT_EQ(hair->is_z_up, true) << "written small";
  EXPECT_THAT(hair->notes, Contains(HasSubstr("1 of 3 strands cannot be used")));
}

TEST(Usdc, EveryVersionAndWayToPackNumbersReadsTheSame) {
  constexpr size_t kStrands = 40;
  std::vector<int32_t> counts;
  std::vector<glm::vec3> points;
  std::vector<float> widths;
  for (size_t strand = 0; strand < kStrands; ++strand) {
    // All widths of differences: none, one byte, two.
    counts.push_back(strand % 4 == 3 ? 250 : strand % 7 == 0 ? 100 : 2);
    for (int32_t vertex = 0; vertex < counts.back(); ++vertex) {
      points.emplace_back(strand, vertex, 0.5f * static_cast<float>(vertex));
      widths.push_back(vertex % 2 == 0 ? 0.25f : 0.125f);
    }
  }
  std::vector<int32_t> table_index, whole;
  for (const float width : widths) table_index.push_back(width == 0.25f ? 1 : 0);
  for (const float width : widths) whole.push_back(static_cast<int32_t>(8.0f * width));
  for (const uint8_t minor : {4, 5, 6, 7, 8, 12}) {
    for (const char way : {'f', 't', 'i', 'd', 'h'}) {
      if (minor < 6 && (way == 't' || way == 'i')) continue;
      SCOPED_TRACE(fmt::format("version 0.{}, {}", minor, way));
      MadeUsdc file(minor);
      std::vector<double> wide;
      std::vector<uint16_t> half;  // 1/8 and 1/4: exponents 12 and 13 of bias 15
      for (const float width : widths) wide.push_back(static_cast<double>(width));
      for (const float width : widths) half.push_back(width == 0.25f ? 13 << 10 : 12 << 10);
      const std::string table =
          "t" + raw_bytes(std::vector<uint32_t>{2}) + raw_bytes(std::vector<float>{0.125f, 0.25f});
      const uint64_t value =
          way == 'f' ? file.array(8, widths.size(), raw_bytes(widths))
          : way == 't'
              ? file.array(8, widths.size(), table + MadeUsdc::packed_ints(table_index), MadeUsdc::kPacked)
          : way == 'i' ? file.array(8, widths.size(), "i" + MadeUsdc::packed_ints(whole), MadeUsdc::kPacked)
          : way == 'd' ? file.array(9, wide.size(), raw_bytes(wide))
                       : file.array(7, half.size(), raw_bytes(half));
      const std::string bytes = file.finish(
          {file.prim("Hair", "BasisCurves",
                     {MadeUsdc::attribute("type", file.token("linear")),
                      MadeUsdc::attribute("curveVertexCounts", file.ints(counts)),
                      MadeUsdc::attribute("points", file.array(24, points.size(), raw_bytes(points))),
                      MadeUsdc::attribute("widths", value)})});
      const auto stage = read_usdc_stage(std::make_shared<GroomSource>(bytes_of(bytes)));
      ASSERT_TRUE(stage) << stage.error().to_string();
      const UsdCurves& curves = *stage->prim[0].curves;
      EXPECT_EQ(curves.points, points);
      EXPECT_TRUE(std::equal(counts.begin(), counts.end(), curves.vertex_counts.begin()));
      std::vector<float> expected = widths;
      if (way == 'i')
        for (float& width : expected) width *= 8.0f;
      EXPECT_EQ(curves.widths, expected);
    }
  }
}

TEST(Usdc, PointsAreFloatsDoublesOrHalves) {
  const std::vector<glm::dvec3> wide = {{0, 0, 0}, {0, 0, 1}, {0, 1, 2.5}, {1, 0, 0}, {1, 0, -1}};
  constexpr uint16_t kOne = 0x3c00, kMinusOne = 0xbc00, kTwoAndAHalf = 0x4100;
  const std::vector<uint16_t> half = {0,    0, 0, 0,    0, kOne,     0, kOne, kTwoAndAHalf,
                                      kOne, 0, 0, kOne, 0, kMinusOne};
  for (const int type : {23, 24, 25}) {
    MadeUsdc file;
    std::vector<MadeSpec> items = line_items(file);
    items.back().fields[0].second = type == 23   ? file.array(23, 5, raw_bytes(wide))
                                    : type == 24 ? file.array(24, 5, raw_bytes(kPoints))
                                                 : file.array(25, 5, raw_bytes(half));
    const auto groom = read_usd(file.finish({file.prim("Hair", "BasisCurves", items)}));
    ASSERT_TRUE(groom) << groom.error().to_string();
    EXPECT_EQ(groom->groom.rest_position_m, kPoints) << type;
  }
}

/// The op of the transform around the lines, by a value.
std::vector<double> op_with(MadeUsdc& file, const std::string& name, uint64_t value) {
  const std::string bytes = lines(
      file, {}, {MadeUsdc::attribute(name, value), MadeUsdc::attribute("xformOpOrder", file.tokens({name}))});
  const auto stage = read_usdc_stage(std::make_shared<GroomSource>(bytes_of(bytes)));
  EXPECT_TRUE(stage) << stage.error().to_string();
  return stage ? stage->prim[0].op.at(0).value : std::vector<double>{};
}

TEST(Usdc, SmallValuesStandInThePlaceOfTheirOffset) {
  MadeUsdc a, b, c, d, e, f, g;
  constexpr uint64_t kBytes = 0x0a'01'fe;  // -2, 1, 10, lowest first
  EXPECT_THAT(op_with(a, "xformOp:scale", MadeUsdc::inlined(24, kBytes)), ElementsAre(-2, 1, 10));
  EXPECT_THAT(op_with(b, "xformOp:scale", MadeUsdc::inlined(23, kBytes)), ElementsAre(-2, 1, 10));
  EXPECT_THAT(op_with(c, "xformOp:rotateX", MadeUsdc::inlined(8, std::bit_cast<uint32_t>(22.5f))),
              ElementsAre(22.5));
  EXPECT_THAT(op_with(d, "xformOp:rotateX", MadeUsdc::inlined(9, std::bit_cast<uint32_t>(22.5f))),
              ElementsAre(22.5));
  EXPECT_THAT(op_with(e, "xformOp:transform", MadeUsdc::inlined(15, 0x01'0a'01'fe)),
              ElementsAre(-2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 10, 0, 0, 0, 0, 1));
  // In the file the real part of a quaternion is the last.
  EXPECT_THAT(op_with(f, "xformOp:orient", f.scalar(17, raw_bytes(std::vector<float>{0, 0, 1, 0.5f}))),
              ElementsAre(0.5, 0, 0, 1));
  EXPECT_THAT(
      op_with(g, "xformOp:orient", g.scalar(18, raw_bytes(std::vector<uint16_t>{0, 0, 0x3c00, 0x3800}))),
      ElementsAre(0.5, 0, 0, 1));
}

TEST(Usdc, WhatHasNoTimeGoesBeforeTheFirstOfTimeSamples) {
  MadeUsdc file;
  std::vector<glm::vec3> other = kPoints;
  for (glm::vec3& point : other) point += glm::vec3(7);
  const uint64_t samples =
      file.samples({7.5, 8}, {file.array(24, 5, raw_bytes(kPoints)), MadeUsdc::rep(51, 0)});
  std::vector<MadeSpec> items = line_items(file);
  const uint64_t still = file.array(24, 5, raw_bytes(other));
  const auto with = [&](std::vector<std::pair<std::string, uint64_t>> fields) {
    items.back().fields = std::move(fields);
    MadeUsdc copy = file;
    return read_usd(copy.finish({copy.prim("Hair", "BasisCurves", items)}));
  };
  const auto timed = with({{"timeSamples", samples}});
  ASSERT_TRUE(timed) << timed.error().to_string();
  EXPECT_EQ(timed->groom.rest_position_m, kPoints);
  EXPECT_THAT(timed->notes, Contains(HasSubstr("time code 7.5, the first")));
  EXPECT_EQ(with({{"timeSamples", samples}, {"default", still}})->groom.rest_position_m, other);
  for (const uint64_t none :
       {MadeUsdc::rep(51, 0), MadeUsdc::inlined(51, 0), MadeUsdc::rep(24, 0, MadeUsdc::kArray)})
    EXPECT_EQ(with({{"default", none}, {"timeSamples", samples}})->groom.rest_position_m, kPoints);
}

TEST(Usdc, WhatDoesNotCountIsLeftOut) {
  const auto strands = [](std::vector<std::pair<std::string, uint64_t>> fields, const std::string& property,
                          const std::string& value) {
    MadeUsdc file;
    MadeSpec off = file.prim("Off", "BasisCurves", line_items(file));
    off.fields.insert(off.fields.begin(), fields.begin(), fields.end());
    if (!property.empty()) off.items.push_back(MadeUsdc::attribute(property, file.token(value)));
    const auto groom = read_usd(file.finish({off, file.prim("On", "BasisCurves", line_items(file))}));
    EXPECT_TRUE(groom) << groom.error().to_string();
    return groom->groom.strand_count();
  };
  EXPECT_EQ(strands({}, "", ""), 4u);
  EXPECT_EQ(strands({{"active", MadeUsdc::inlined(1, 0)}}, "", ""), 2u);
  EXPECT_EQ(strands({{"active", MadeUsdc::inlined(1, 1)}}, "", ""), 4u);
  EXPECT_EQ(strands({}, "visibility", "invisible"), 2u);
  EXPECT_EQ(strands({}, "visibility", "inherited"), 4u);
  for (const uint64_t over_or_class : {1, 2})
    EXPECT_EQ(strands({{"specifier", MadeUsdc::inlined(42, over_or_class)}}, "", ""), 2u);
}

TEST(Usdc, InstancersAreLeftOutAndCounted) {
  MadeUsdc file;
  const auto tufts = file.prim("Tufts", "PointInstancer",
                               {MadeUsdc::attribute("protoIndices", file.ints({0, 0, 0, 0})),
                                file.prim("Tuft", "BasisCurves", line_items(file))});
  const auto groom = read_usd(file.finish({tufts, file.prim("On", "BasisCurves", line_items(file))}));
  ASSERT_TRUE(groom) << groom.error().to_string();
  EXPECT_EQ(groom->groom.strand_count(), 2u);
  EXPECT_THAT(groom->notes, ::testing::Contains(HasSubstr("1 PointInstancer with 4 instances are left out")));
}

/// Members of a package as they are stored, one behind the other.
std::string package(const std::vector<std::pair<std::string, std::string>>& members, uint16_t method = 0) {
  std::string zip;
  for (const auto& [name, content] : members) {
    const auto size = static_cast<uint32_t>(content.size());
    zip += "PK\3\4" + raw_bytes(std::vector<uint16_t>{10, 0, method, 0, 0, 0, 0}) +
           raw_bytes(std::vector<uint32_t>{size, size}) +
           raw_bytes(std::vector<uint16_t>{static_cast<uint16_t>(name.size()), 5}) + name + "extra" + content;
  }
  return zip + "PK\1\2";
}

TEST(Usdc, APackageIsItsFirstLayerInEitherForm) {
  MadeUsdc file;
  const std::string binary = lines(file);
  const std::string text =
      "#usda 1.0\ndef BasisCurves \"b\" { uniform token type = \"linear\" int[] curveVertexCounts = [2] "
      "point3f[] "
      "points = [(0,0,0), (0,0,1)] }";
  EXPECT_EQ(read_usd(package({{"a.usdc", binary}}))->groom.rest_position_m, kPoints);
  EXPECT_EQ(
      read_usd(package({{"skin.png", "PNG"}, {"a.usd", text}, {"b.usdc", binary}}))->groom.strand_count(),
      1u);
  EXPECT_THAT(refusal(package({{"skin.png", "PNG"}})), HasSubstr("the package holds no .usd"));
  EXPECT_THAT(refusal(package({{"a.usdc", binary}}, 8)),
              HasSubstr("'a.usdc' in the package is not stored as it is"));
  EXPECT_THAT(refusal(package({{"a.usdc", binary}}).substr(0, 200)), HasSubstr("cut off: it should have"));
  // By their bytes, whatever the name says.
  const TemporaryFolder folder;
  for (const auto& [name, bytes] : {std::pair("a.usd", binary),
                                    {"b.usd", text},
                                    {"c.usda", binary},
                                    {"d.usdc", text},
                                    {"e.USDZ", package({{"x.usdc", binary}})}}) {
    GroomFileOptions options;
    options.path = folder.write(name, bytes);
    const auto groom = load_groom(options);
    EXPECT_TRUE(groom) << name << groom.error().to_string();
  }
  GroomFileOptions options;
  const std::string whole = package({{"x.usdc", binary}});
  options.path = folder.write("g.usdz", whole.substr(0, whole.size() - 100));
  EXPECT_THAT(load_groom(options).error().to_string(),
              AllOf(HasSubstr("x.usdc"), HasSubstr("copy it again")));
  options.path = folder.write("f.usdc", binary.substr(0, 300));
  EXPECT_THAT(load_groom(options).error().to_string(),
              AllOf(HasSubstr("f.usdc"), HasSubstr("cut off at byte 300"), HasSubstr("copy it again")));
}

std::string with_number(std::string file, size_t at, uint64_t number) {
  std::memcpy(file.data() + at, &number, sizeof(number));
  return file;
}

TEST(Usdc, WhatIsWrongIsNamedWithItsPrim) {
  constexpr size_t kContentsAt = 16;
  MadeUsdc file;
  const std::string whole = lines(file);
  EXPECT_THAT(refusal("PXR-USDC"), HasSubstr("the header of binary USD alone has 88"));
  EXPECT_THAT(refusal(with_number(whole, kContentsAt, 0)), HasSubstr("its writer did not finish it"));
  EXPECT_THAT(refusal(with_number(whole, 8, 0x0103)), HasSubstr("version 3.1"));
  EXPECT_THAT(refusal(with_number(whole, 8, 0x0300)), HasSubstr("version 0.3, known is 0.4 and later"));
  // The number of tokens, of paths and of specs is the first of its section.
  uint64_t contents = 0;
  std::memcpy(&contents, whole.data() + kContentsAt, sizeof(contents));
  for (const auto& [section, word] : {std::pair(0, "tokens"),
                                      {1, "strings"},
                                      {2, "fields"},
                                      {3, "field sets"},
                                      {4, "paths"},
                                      {5, "specs"}}) {
    uint64_t begin = 0;
    std::memcpy(&begin, whole.data() + contents + 8 + 32 * static_cast<size_t>(section) + 16, sizeof(begin));
    EXPECT_THAT(refusal(with_number(whole, begin, uint64_t{1} << 40)),
                HasSubstr(fmt::format("1099511627776 {}, at most", word)));
  }
  const auto refused = [](const std::string& name, auto&& value_of) {
    MadeUsdc own;
    std::vector<MadeSpec> items = line_items(own);
    items.push_back(MadeUsdc::attribute(name, value_of(own)));
    return refusal(own.finish({own.prim("Hair", "BasisCurves", items)}));
  };
  EXPECT_THAT(refused("points", [](MadeUsdc& own) { return own.token("x"); }),
              HasSubstr("prim 'Hair', points: a value of type 11 where points belong"));
  EXPECT_THAT(refused("points", [](MadeUsdc& own) { return own.array(24, 1ull << 30, "x"); }),
              HasSubstr("an array of 1073741824 values, at most 16000000"));
  EXPECT_THAT(refused("curveVertexCounts",
                      [](MadeUsdc& own) {
                        return own.ints({3, -2});
                      }),
              HasSubstr("-2 is no number of vertices"));
  EXPECT_THAT(refused("wrap", [](MadeUsdc& own) { return own.token("periodic"); }),
              HasSubstr("closed curves"));
  EXPECT_THAT(refused("wrap", [](MadeUsdc&) { return MadeUsdc::inlined(11, 1u << 20); }),
              HasSubstr("token 1048576 of"));
  EXPECT_THAT(refused("widths",
                      [](MadeUsdc& own) {
                        return own.array(8, 20,
                                         "t" + raw_bytes(std::vector<uint32_t>{1, 0}) +
                                             MadeUsdc::packed_ints(std::vector<int32_t>(20, 1)),
                                         MadeUsdc::kPacked);
                      }),
              HasSubstr("number 1 of a table of 1"));
}

// 16 KB that unpack to 16 million numbers count as these, each time: nine times is too often.
TEST(Usdc, WhatIsUnpackedCountsAsRead) {
  constexpr size_t kNumbers = 16'000'000;
  const size_t rest = sizeof(int32_t) + kNumbers / 4 - 1 - 5 - 4 - 15;  // of a match behind one zero
  const std::string zeros = std::string("\0\x1f\0\1\0", 5) + std::string(rest / 255, '\xff') +
                            static_cast<char>(rest % 255) + std::string("\x50\0\0\0\0\0", 6);
  MadeUsdc file;
  const uint64_t value = file.array(8, kNumbers, "i" + raw_bytes(std::vector<uint64_t>{zeros.size()}) + zeros,
                                    MadeUsdc::kPacked);
  const std::string bytes = file.finish({});
  const auto archive = UsdcArchive::read(std::make_shared<GroomSource>(bytes_of(bytes)));
  ASSERT_TRUE(archive) << archive.error().to_string();
  size_t count = 0;
  auto numbers = archive->floats({value}, kNumbers);
  for (; numbers; numbers = archive->floats({value}, kNumbers)) ++count;
  EXPECT_EQ(count, kMaxGroomReadBytes / (kNumbers * sizeof(float)));
  EXPECT_THAT(numbers.error().to_string(), HasSubstr("more than 536870912 bytes"));
}

TEST(Usdc, TreesThatAreNoneAreRefused) {
  MadeUsdc deep;
  MadeSpec inner = deep.prim("a", "", {});
  for (int i = 0; i < 64; ++i) inner = deep.prim("a", "", {inner});
  EXPECT_THAT(refusal(deep.finish({inner})), HasSubstr("prims in each other, more than 64"));
  MadeUsdc twice;
  MadeSpec parent = twice.prim("p", "", {twice.prim("a", "", {})});
  parent.fields.emplace_back("primChildren", twice.token_vector({"a", "a"}));
  EXPECT_THAT(refusal(twice.finish({parent})), HasSubstr("a prim 'a' is named that is not there, or twice"));
}

std::string rich_file() {
  auto stage = read_usda_stage(kRichText);
  EXPECT_TRUE(stage);
  stage->prim[1].curves->type = "linear";
  return binary_of(*stage);
}

TEST(Usdc, EveryTruncationIsRefused) {
  const std::string whole = rich_file();
  ASSERT_EQ(refusal(whole), "accepted");
  for (size_t size = 0; size < whole.size(); ++size)
    ASSERT_NE(refusal(whole.substr(0, size)), "accepted") << size << " of " << whole.size();
  EXPECT_THAT(refusal(whole.substr(0, whole.size() / 4)),
              ::testing::AllOf(HasSubstr("which stands at the end: nothing of it can be had"),
                               HasSubstr("copy it again, or export it anew")));
}

TEST(Usdc, EveryDamagedByteGivesASentenceOrASoundGroom) {
  constexpr size_t kSmallBytes = 64u << 10, kMostExpansion = 255;
  const std::string whole = rich_file();
  size_t refused = 0;
  for (size_t at = 0; at < whole.size(); ++at) {
    for (const int flip : {1, 0x80, 0xff}) {
      std::string damaged = whole;
      damaged[at] = static_cast<char>(damaged[at] ^ flip);
      test::reset_largest_allocation();
      const auto groom = read_usd(damaged);
      EXPECT_LT(test::largest_allocation_bytes(), kMostExpansion * whole.size() + kSmallBytes) << at;
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

// Thickness, stiffness and rest shape as the proposal for deformable bodies of USD's physics has them.
TEST(Usdc, WhatHairIsMadeOfComesBackInEveryFormOfUsd) {
  using namespace export_test;
  const TemporaryFolder folder;
  const std::atomic<bool> never{false};
  auto origin = std::make_shared<ExportOrigin>();
  for (uint32_t strand = 0; strand < kStrands; ++strand) origin->place.push_back(strand);
  origin->material = {7e-5, 4e9, 1250.0, 0.25};
  for (const std::string extension : {".usda", ".usdc", ".usdz"})
    for (const double unit_m : {1.0, 0.01, 0.0254}) {
      SCOPED_TRACE(extension);
      MadeStates states(3);
      states.scene_.origin = origin;
      ExportOptions options;
      options.path = folder.path() / ("hair" + extension);
      options.unit_m = unit_m;
      options.is_quiet = true;
      ASSERT_TRUE(export_strands(states, options, never));
      GroomFileOptions again;
      again.path = options.path;
      const auto placed = load_placed_groom(again);
      ASSERT_TRUE(placed) << placed.error().to_string();
      EXPECT_NEAR(placed->material.diameter.value_or(0.0), 7e-5, 1e-10);
      EXPECT_NEAR(placed->material.young_modulus.value_or(0.0), 4e9, 1e4);
      EXPECT_NEAR(placed->material.density.value_or(0.0), 1250.0, 1e-2);
      EXPECT_NEAR(placed->material.poisson_ratio.value_or(0.0), 0.25, 1e-6);
      EXPECT_THAT(placed->notes, Contains(HasSubstr("rest shape of its curve physics")));
      EXPECT_EQ(placed->groom.strand_count(), kStrands);
      // Without a word of its files there is nothing to say.
      MadeStates silent(3);
      ASSERT_TRUE(export_strands(silent, options, never));
      EXPECT_FALSE(load_placed_groom(again)->material.is_known());
    }
}

}  // namespace
}  // namespace strandcast::groom_usdc_test

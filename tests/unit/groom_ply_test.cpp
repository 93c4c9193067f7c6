// Strands in `.ply` files: bare points, and all the ways in which files say where strands begin.
#include <algorithm>
#include <bit>
#include <cmath>

#include "common/base/hash.h"
#include "common/groom/groom_file.h"
#include "common/groom/ply_loader.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::groom_ply_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

Result<StatedGroom> read(const std::string& text, uint32_t strand_vertex_count = 0) {
  return read_ply(std::as_bytes(std::span(text)), strand_vertex_count);
}
std::string refusal(const std::string& text, uint32_t strand_vertex_count = 0) {
  const auto groom = read(text, strand_vertex_count);
  return groom ? "accepted" : groom.error().to_string();
}
std::string header(const std::string& format, const std::string& elements) {
  return "ply\nformat " + format + " 1.0\n" + elements + "end_header\n";
}
const std::string kFivePoints = "element vertex 5\nproperty float x\nproperty float y\nproperty float z\n";
const std::string kFiveRows = "0 0 0\n0 1 0\n0 2.5e-1 -1.5\n1 0 0\n1 +1 0\n";
const std::vector<glm::vec3> kFive = {{0, 0, 0}, {0, 1, 0}, {0, 0.25f, -1.5f}, {1, 0, 0}, {1, 1, 0}};

template <class T>
std::string raw(T value, bool is_big) {
  std::string bytes(reinterpret_cast<const char*>(&value), sizeof(value));
  if (is_big) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

/// Strands that wave downwards from roots on a ball of 0.1 m: `count` points each, the roots in rings as a
/// reconstruction leaves them.
std::vector<glm::vec3> hanging(uint32_t strand_count, uint32_t count) {
  std::vector<glm::vec3> points;
  for (uint32_t s = 0; s < strand_count; ++s) {
    const float angle = 2.4f * static_cast<float>(s);
    const float up = 0.9f - 0.8f * static_cast<float>(s) / static_cast<float>(strand_count);
    const float out = std::sqrt(1.0f - up * up);
    const glm::vec3 root = 0.1f * glm::vec3(out * std::cos(angle), up, out * std::sin(angle));
    const float length_m = 0.1f + 0.15f * static_cast<float>(s % 7) / 7.0f;
    for (uint32_t i = 0; i < count; ++i) {
      const float t = static_cast<float>(i) / static_cast<float>(count - 1);
      points.push_back(root + glm::vec3(0.01f * std::sin(9.0f * t), -length_m * t, 0.0f));
    }
  }
  return points;
}
std::string bare(const std::vector<glm::vec3>& points) {
  std::string text = header("ascii", fmt::format("element vertex {}\nproperty float x\nproperty float y\n"
                                                 "property float z\n",
                                                 points.size()));
  for (const glm::vec3& p : points) text += fmt::format("{} {} {}\n", p.x, p.y, p.z);
  return text;
}

TEST(Ply, StrandsOfTheirOwnLengthFromSegmentCounts) {
  const auto groom =
      read(header("ascii", kFivePoints + "element strand 2\nproperty ushort nsegs\n") + kFiveRows + "2\n1\n");
  ASSERT_TRUE(groom) << groom.error().to_string();
  EXPECT_EQ(groom->groom.offset, (std::vector<uint32_t>{0, 3, 5}));
  EXPECT_EQ(groom->groom.rest_position_m, kFive);
  EXPECT_EQ(groom->groom.pinned, (std::vector<uint8_t>{1, 0, 0, 1, 0}));
  EXPECT_FALSE(groom->unit_m || groom->is_z_up);
}

TEST(Ply, VertexCountsListsAndEdgesSayTheSame) {
  const std::string counts =
      header("ascii", kFivePoints + "element curve 2\nproperty int nverts\n") + kFiveRows + "3 2\n";
  const std::string lists =
      header("ascii", kFivePoints + "element strand 2\nproperty list uchar int vertex_indices\n") +
      kFiveRows + "3 0 1 2\n2 3 4\n";
  // Edges in no order; each strand begins at the end that comes first in the file.
  const std::string edges =
      header("ascii", kFivePoints + "element edge 3\nproperty int vertex1\nproperty int vertex2\n") +
      kFiveRows + "2 1\n4 3\n0 1\n";
  for (const std::string& text : {counts, lists, edges}) {
    const auto groom = read(text);
    ASSERT_TRUE(groom) << groom.error().to_string();
    EXPECT_EQ(groom->groom.offset, (std::vector<uint32_t>{0, 3, 5}));
    EXPECT_EQ(groom->groom.rest_position_m, kFive);
  }
}

TEST(Ply, ListsMayShareAndReorderPoints) {
  const auto groom =
      read(header("ascii", kFivePoints + "element strand 2\nproperty list uchar int vertices\n") + kFiveRows +
           "2 4 0\n2 4 1\n");
  ASSERT_TRUE(groom) << groom.error().to_string();
  EXPECT_EQ(groom->groom.rest_position_m, (std::vector<glm::vec3>{kFive[4], kFive[0], kFive[4], kFive[1]}));
}

TEST(Ply, BinaryOfBothByteOrdersIsTheSameAsText) {
  const std::string elements =
      "comment made by hand\nelement colour 1\nproperty list ushort uchar of_hair\nelement vertex 5\n"
      "property double x\nproperty float y\nproperty uchar red\nproperty float z\n"
      "element strand 2\nproperty short nsegs\n";
  for (const bool is_big : {false, true}) {
    std::string text = header(is_big ? "binary_big_endian" : "binary_little_endian", elements);
    text += raw(uint16_t{3}, is_big) + "abc";
    for (const glm::vec3& p : kFive)
      text += raw(static_cast<double>(p.x), is_big) + raw(p.y, is_big) + "r" + raw(p.z, is_big);
    text += raw(int16_t{2}, is_big) + raw(int16_t{1}, is_big);
    const auto groom = read(text);
    ASSERT_TRUE(groom) << groom.error().to_string();
    EXPECT_EQ(groom->groom.rest_position_m, kFive);
    EXPECT_EQ(groom->groom.offset, (std::vector<uint32_t>{0, 3, 5}));
    for (size_t size = 0; size < text.size(); ++size)
      ASSERT_NE(refusal(text.substr(0, size)), "accepted") << size << " bytes of " << text.size();
    EXPECT_THAT(read(text + "xy")->notes, ::testing::ElementsAre("2 bytes after the last row are left out"));
    EXPECT_THAT(refusal(text + std::string(text.size(), 'x')),
                HasSubstr("bytes are left after the last row"));
  }
}

TEST(Ply, BarePointsAreCutWhereTheyJump) {
  for (const uint32_t count : {16u, 20u, 50u, 100u, 128u}) {
    const std::vector<glm::vec3> points = hanging(50, count);
    const auto groom = read(bare(points));
    ASSERT_TRUE(groom) << groom.error().to_string();
    EXPECT_EQ(groom->groom.strand_count(), 50u) << count;
    EXPECT_EQ(groom->groom.uniform_vertex_count(), count);
    EXPECT_EQ(groom->groom.rest_position_m, points);
    ASSERT_EQ(groom->notes.size(), 1u);
    EXPECT_THAT(groom->notes[0],
                AllOf(HasSubstr(fmt::format("{} points per strand", count)),
                      HasSubstr("100 % of the places where strands would meet are jumps, and 0 "
                                "elsewhere"),
                      HasSubstr("groom.file.strand_vertex_count")));
  }
}

TEST(Ply, ASettingGoesBeforeWhatTheFileSaysOrPointsTell) {
  const std::vector<glm::vec3> points = hanging(50, 20);
  const auto groom = read(bare(points), 10);
  ASSERT_TRUE(groom);
  EXPECT_EQ(groom->groom.strand_count(), 100u);
  EXPECT_TRUE(groom->notes.empty());
  EXPECT_THAT(refusal(bare(points), 7), AllOf(HasSubstr("1000 points"), HasSubstr("7 each")));
}

TEST(Ply, PointsThatDoNotJumpAreTakenAsNeuralToolsLeaveThem) {
  std::vector<glm::vec3> line;
  for (int i = 0; i < 300; ++i) line.emplace_back(0.0f, 0.001f * static_cast<float>(i), 0.0f);
  const auto groom = read(bare(line));
  ASSERT_TRUE(groom) << groom.error().to_string();
  EXPECT_EQ(groom->groom.uniform_vertex_count(), kUsualPlyStrandVertices);
  EXPECT_THAT(groom->notes.at(0), HasSubstr("the points do not say"));
  line.resize(299);
  EXPECT_THAT(refusal(bare(line)),
              AllOf(HasSubstr("299 points"), HasSubstr("groom.file.strand_vertex_count says how many")));
}

// Splats, and points that a program has mixed: strands through them would be lies.
TEST(Ply, PointsInNoOrderAreNoStrands) {
  std::vector<glm::vec3> points = hanging(100, 20);
  EXPECT_EQ(refusal(bare(points)), "accepted");
  EXPECT_EQ(refusal(bare(points), 20), "accepted");
  for (size_t i = points.size() - 1; i > 0; --i)
    std::swap(points[i], points[mix_u32(static_cast<uint32_t>(i)) % (i + 1)]);
  const auto told = AllOf(HasSubstr("2000 points are in no order"), HasSubstr("export curves"));
  EXPECT_THAT(refusal(bare(points)), told);
  EXPECT_THAT(refusal(bare(points), 20), told) << "whoever says how many a strand has";
  std::string counted = bare(points);
  counted.insert(counted.find("end_header"), "element strand 100\nproperty int nverts\n");
  for (int strand = 0; strand < 100; ++strand) counted += "20\n";
  EXPECT_THAT(refusal(counted), told) << "so does the file";
  // Long hair of few points, in no order of strands, is in order.
  std::vector<glm::vec3> longer;
  for (uint32_t s = 0; s < 200; ++s) {
    const uint32_t root = mix_u32(s);
    const glm::vec3 at(0.1f * unit_float(root), 0.1f * unit_float(mix_u32(root)),
                       0.1f * unit_float(root + 1));
    for (uint32_t i = 0; i < 10; ++i)
      longer.push_back(at - glm::vec3(0.0f, 0.3f * static_cast<float>(i), 0.0f));
  }
  EXPECT_EQ(refusal(bare(longer), 10), "accepted");
}

TEST(Ply, CommentsStateUnitAxisAndCount) {
  const std::string text = header("ascii",
                                  "comment unit_m 0.01\ncomment up_axis Z\ncomment strand_vertex_count 2\n"
                                  "comment up_axis of what?\nelement vertex 4\nproperty float x\n"
                                  "property float y\nproperty float z\n") +
                           "0 0 0 0 0 1 1 0 0 1 0 1";
  const auto groom = read(text);
  ASSERT_TRUE(groom) << groom.error().to_string();
  EXPECT_EQ(groom->groom.strand_count(), 2u);
  EXPECT_EQ(groom->unit_m, 0.01f);
  EXPECT_EQ(groom->is_z_up, true);

  const TemporaryFolder folder;
  GroomFileOptions options;
  options.path = folder.write("said.ply", text);
  options.is_z_up.reset();
  const auto placed = load_placed_groom(options);
  ASSERT_TRUE(placed) << placed.error().to_string();
  EXPECT_TRUE(placed->placement.is_z_up);
  EXPECT_FLOAT_EQ(placed->placement.unit_m, 0.01f);
  EXPECT_NEAR(placed->groom.rest_position_m[1].y, 0.01f, 1e-8f);
  EXPECT_THAT(placed->notes, ::testing::Contains(HasSubstr("1 unit = 10 mm: a comment of the file says so")));
  options.unit_m = 1.0f;
  EXPECT_FLOAT_EQ(load_placed_groom(options)->placement.unit_m, 1.0f) << "what a person says goes first";
}

TEST(Ply, AStrandOfOnePointIsLeftOutAndDecimalCommasAreRead) {
  const std::string strands = header("ascii", kFivePoints + "element strand 2\nproperty int nsegs\n");
  std::string rows = kFiveRows;
  std::replace(rows.begin(), rows.end(), '.', ',');
  const auto groom = read(strands + rows + "3\n0\n");
  ASSERT_TRUE(groom) << groom.error().to_string();
  EXPECT_EQ(groom->groom.offset, (std::vector<uint32_t>{0, 4}));
  EXPECT_EQ(groom->groom.rest_position_m[2], glm::vec3(0.0f, 0.25f, -1.5f));
  EXPECT_THAT(groom->notes, ::testing::ElementsAre(HasSubstr("2 numbers have a decimal comma"),
                                                   HasSubstr("1 of 2 strands cannot be used")));
}

TEST(Ply, AByteOrderMarkIsNoPartOfTheFile) {
  const std::string text =
      header("binary_little_endian", kFivePoints + "element strand 1\nproperty uchar nverts\n");
  std::string rows;
  for (const glm::vec3& point : kFive)
    for (int axis = 0; axis < 3; ++axis) rows += raw(point[axis], false);
  const auto groom = read("\xef\xbb\xbf" + text + rows + raw(uint8_t{5}, false));
  ASSERT_TRUE(groom) << groom.error().to_string();
  EXPECT_EQ(groom->groom.rest_position_m, kFive);
}

TEST(Ply, AFileThatIsCutOffGivesWhatItHas) {
  const std::vector<glm::vec3> points = hanging(50, 20);
  const std::string whole = bare(points);
  // The last 2 of 50 strands, and a part of the one before them.
  std::string cut = whole;
  for (int row = 0; row < 45; ++row) cut.resize(cut.rfind('\n', cut.size() - 2) + 1);
  const auto groom = read(cut);
  ASSERT_TRUE(groom) << groom.error().to_string();
  EXPECT_EQ(groom->groom.strand_count(), 47u);
  EXPECT_EQ(groom->groom.rest_position_m, std::vector<glm::vec3>(points.begin(), points.begin() + 47 * 20));
  EXPECT_THAT(groom->notes,
              ::testing::Contains(HasSubstr("45 of 1000 rows cannot be used, since the file is cut "
                                            "off; the first: vertex 955 x: the file ends there")));
  EXPECT_THAT(refusal(whole.substr(0, whole.size() / 2)), HasSubstr("a tenth at most may be so"));
}

TEST(Ply, AWordThatIsNoNumberCostsItsStrandAlone) {
  const std::vector<glm::vec3> points = hanging(50, 20);
  std::string text = bare(points);
  const size_t last_row = text.rfind('\n', text.size() - 2) + 1;
  text.replace(last_row, text.find(' ', last_row) - last_row, "-1.#IND");
  const auto groom = read(text);
  ASSERT_TRUE(groom) << groom.error().to_string();
  EXPECT_EQ(groom->groom.rest_position_m, std::vector<glm::vec3>(points.begin(), points.end() - 20));
  EXPECT_THAT(groom->notes, ::testing::Contains(HasSubstr("1 of 50 strands cannot be used")));
}

TEST(Ply, PointsOfNoStrandAreLeftOutWhereTheyAreFew) {
  const std::vector<glm::vec3> points = hanging(11, 2);
  std::string text = bare(points);
  const std::string end = "end_header\n";
  text.insert(text.find(end), "element strand 10\nproperty int nverts\n");
  for (int strand = 0; strand < 10; ++strand) text += "2\n";
  const auto groom = read(text);
  ASSERT_TRUE(groom) << groom.error().to_string();
  EXPECT_EQ(groom->groom.strand_count(), 10u);
  EXPECT_THAT(groom->notes, ::testing::ElementsAre("2 points that no strand has are left out"));
}

TEST(Ply, WhatIsWrongIsNamed) {
  EXPECT_THAT(refusal("plx\n"), HasSubstr("does not begin with the line 'ply'"));
  EXPECT_THAT(refusal("ply\nformat ascii 1.0\n"), HasSubstr("no line 'end_header'"));
  EXPECT_THAT(refusal(header("ascii", kFivePoints) + "0 0 0\n0 1 x\n"),
              HasSubstr("vertex 2 x: the file ends there; 3 of 5 rows cannot be used"));
  EXPECT_THAT(
      refusal(header("ascii", kFivePoints + "element strand 2\nproperty int nsegs\n") + kFiveRows + "x 1"),
      HasSubstr("strand 0 nsegs: 'x' is no number"));
  EXPECT_THAT(refusal(header("binary_middle_endian", kFivePoints)), HasSubstr("line 2: the format is"));
  EXPECT_THAT(refusal(header("ascii", "element vertex 5\nproperty float x\nproperty float y\n") + kFiveRows),
              HasSubstr("no property 'z'"));
  EXPECT_THAT(refusal(header("ascii",
                             "element vertex 99999999999\nproperty float x\nproperty float y\n"
                             "property float z\n")),
              HasSubstr("99999999999 points, at most 16000000"));
  EXPECT_THAT(refusal(header("ascii", "element vertex 5\n") + kFiveRows), HasSubstr("rows and no property"));
  const std::string strands = kFivePoints + "element strand 2\nproperty int nsegs\n";
  EXPECT_THAT(refusal(header("ascii", strands) + kFiveRows + "2\n2\n"),
              HasSubstr("need 6 points, there are 5"));
  EXPECT_THAT(refusal(header("ascii", strands) + kFiveRows + "-2\n5\n"),
              HasSubstr("strand 0 has -1 vertices"));
  const std::string lists = kFivePoints + "element strand 1\nproperty list int int vertex_index\n";
  EXPECT_THAT(refusal(header("ascii", lists) + kFiveRows + "2 0 5\n"),
              HasSubstr("names vertex 5, there are 5"));
  EXPECT_THAT(refusal(header("ascii", lists) + kFiveRows + "-2 0 5\n"), HasSubstr("a list of -2 values"));
  EXPECT_THAT(refusal(header("ascii", lists) + kFiveRows + "2000000000 0\n"),
              HasSubstr("the file ends before"));
  const std::string edges = kFivePoints + "element edge 4\nproperty int vertex1\nproperty int vertex2\n";
  EXPECT_THAT(refusal(header("ascii", edges) + kFiveRows + "0 1 1 2 1 3 3 4\n"),
              HasSubstr("three edges meet at vertex 1"));
  EXPECT_THAT(refusal(header("ascii", edges) + kFiveRows + "0 1 1 2 2 0 3 4\n"), HasSubstr("rings"));
  EXPECT_THAT(
      refusal(header("ascii", kFivePoints + "element face 1\nproperty list uchar int vertex_indices\n") +
              kFiveRows + "3 0 1 2\n"),
      AllOf(HasSubstr("a mesh, no strands"), HasSubstr("head.mesh_path")));
}

}  // namespace
}  // namespace strandcast::groom_ply_test

// Version 2 of `.tfx` is text: real exporters differ in line ends, separators and number forms.
#include <algorithm>

#include "common/groom/groom_file.h"
#include "common/groom/tfx_loader.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::groom_tfx_text_test {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string header(int strand_count, int both_ends) {
  return fmt::format(
      "version 2.0\nscale 1.0\nrotation 0 0 0\ntranslation 0 0 0\nbothEndsImmovable {}\n"
      "maxNumVerticesInStrand 16\nnumFollowHairsPerGuideHair 4\nmaxRadiusAroundGuideHair 1.5\n"
      "numStrands {}\nis sorted 1\n",
      both_ends, strand_count);
}
const char kTwoStrands[] =
    "strand 0 numVerts 3 texcoord 0.250000 000000\n0 0 0\n0 1 0\n0 2.5e-1 -1.5\n"
    "strand 1 numVerts 2 texcoord .5 1\n1 0 0\n1 +1 0\n";

Result<StatedGroom> load_stated(const std::string& text) {
  static const TemporaryFolder folder;
  return load_tfx(folder.write("made.tfx", text));
}
Result<Groom> load(const std::string& text) {
  ASSIGN_OR_RETURN(StatedGroom stated, load_stated(text));
  return std::move(stated.groom);
}
std::string refusal(const std::string& text) {
  const auto groom = load(text);
  if (groom) return "accepted";
  EXPECT_THAT(groom.error().to_string(), AllOf(HasSubstr("made.tfx"), HasSubstr("line ")));
  return groom.error().to_string();
}
std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(TfxText, LoadsStrandsOfTheirOwnLength) {
  const auto groom = load(header(2, 0) + kTwoStrands);
  ASSERT_TRUE(groom) << groom.error().to_string();
  EXPECT_EQ(groom->offset, (std::vector<uint32_t>{0, 3, 5}));
  EXPECT_EQ(groom->rest_position_m[2], glm::vec3(0.0f, 0.25f, -1.5f));
  EXPECT_EQ(groom->rest_position_m[4], glm::vec3(1.0f, 1.0f, 0.0f));
  EXPECT_EQ(groom->root_uv[0], glm::vec2(0.25f, 0.0f));
  EXPECT_EQ(groom->root_uv[1], glm::vec2(0.5f, 1.0f));
  EXPECT_EQ(groom->pinned, (std::vector<uint8_t>{1, 1, 0, 1, 1}));
  EXPECT_EQ(load(header(2, 1) + kTwoStrands)->pinned, (std::vector<uint8_t>{1, 1, 1, 1, 1}));
}

TEST(TfxText, LineEndsBlankLinesAndCommasMakeNoDifference) {
  const std::string unix_text = header(2, 0) + kTwoStrands;
  const auto expected = load(unix_text);
  ASSERT_TRUE(expected);
  std::string dos, mac, mixed, commas;
  int line = 0;
  for (const char c : unix_text) {
    dos += c == '\n' ? "\r\n" : std::string(1, c);
    mac += c == '\n' ? '\r' : c;
    mixed += c != '\n' ? std::string(1, c) : ++line % 3 == 0 ? "\r\n" : line % 3 == 1 ? "\n\n  \t\n" : "\r";
  }
  commas = header(2, 0);
  for (const char c : std::string(kTwoStrands)) {
    if (c == ' ' && std::isdigit(static_cast<unsigned char>(commas.back())) != 0) commas += ',';
    commas += c;
  }
  ASSERT_NE(commas, unix_text);
  for (const std::string& text :
       {dos, mac, mixed, commas, unix_text.substr(0, unix_text.size() - 1), "\xef\xbb\xbf" + unix_text}) {
    const auto groom = load(text);
    ASSERT_TRUE(groom) << groom.error().to_string();
    EXPECT_EQ(groom->rest_position_m, expected->rest_position_m);
    EXPECT_EQ(groom->offset, expected->offset);
  }
}

TEST(TfxText, EveryTruncationInsideOfALineOrStrandIsRefused) {
  const std::string whole = header(2, 0) + kTwoStrands;
  // Up to the last line: a last number that lost digits is still a number.
  for (size_t size = std::string("version 2").size(); size + 6 < whole.size(); ++size) {
    ASSERT_NE(refusal(whole.substr(0, size)), "accepted") << size;
  }
}

TEST(TfxText, NamesLineAndOffendingWord) {
  const std::string good = header(2, 0) + kTwoStrands;
  EXPECT_THAT(refusal(replaced(good, "version 2.0", "version 1.9")),
              AllOf(HasSubstr("line 1"), HasSubstr("'1.9'")));
  EXPECT_THAT(refusal(replaced(good, "version 2.0", "version abc")), HasSubstr("'abc'"));
  EXPECT_THAT(refusal(replaced(good, "rotation", "rotund")),
              AllOf(HasSubstr("line 3"), HasSubstr("'rotund'")));
  EXPECT_THAT(refusal(replaced(good, "numStrands 2", "numStrands 0")), HasSubstr("0 strands"));
  EXPECT_THAT(refusal(replaced(good, "numStrands 2", "numStrands -2")), HasSubstr("'-2'"));
  EXPECT_THAT(refusal(replaced(good, "numStrands 2", "numStrands 200001")),
              HasSubstr("200001 strands, at most"));
  EXPECT_THAT(refusal(replaced(good, "numStrands 2", "numStrands 99999999999999")),
              HasSubstr("'99999999999999'"));
  EXPECT_THAT(refusal(replaced(good, "numStrands 2", "numStrands 3")),
              HasSubstr("ends after 2 of 3 strands"));
  EXPECT_EQ(refusal(replaced(good, "numStrands 2", "numStrands 1")), "accepted");
  EXPECT_THAT(refusal(replaced(good, "numStrands 2\n", "")), HasSubstr("before 'numStrands'"));
  EXPECT_THAT(refusal(replaced(good, "Immovable 0", "Immovable 7")), HasSubstr("bothEndsImmovable is 7"));
  EXPECT_THAT(refusal(replaced(good, "numVerts 3", "numVerts 4")),
              HasSubstr("strand 0 ends at vertex 3 of 4; 1 of 2 strands cannot be used"));
  EXPECT_THAT(refusal(replaced(good, "numVerts 3", "numVerts 2")),
              HasSubstr("'0' follows the last of 2 vertices of strand 0"));
  EXPECT_THAT(refusal(replaced(good, "numVerts 3", "numVerts 4294967295")),
              HasSubstr("at most 4096 are allowed"));
  EXPECT_THAT(refusal(replaced(good, "texcoord", "texture")), HasSubstr("'texture'"));
  EXPECT_THAT(refusal(replaced(good, "0 1 0", "0 x 0")), AllOf(HasSubstr("line 13"), HasSubstr("'x'")));
  EXPECT_THAT(refusal(replaced(good, "0 1 0", "0 1e99 0")), HasSubstr("'1e99'"));
  EXPECT_THAT(refusal(replaced(good, "0 1 0", "0 1")), HasSubstr("''"));
  EXPECT_THAT(refusal(replaced(good, "0 1 0", "0 1 0 4")), HasSubstr("'4'"));
  EXPECT_THAT(refusal("version"), HasSubstr("''"));
}

// One strand in a tenth may be broken, whatever is wrong with it; the others are as without it.
TEST(TfxText, BrokenStrandsAreLeftOutAndCounted) {
  std::string whole;
  const auto strand = [](int i) {
    return fmt::format("strand {} numVerts 3 texcoord 0.5 0.25\n{} 0 0\n{} 1 0\n{} 2.5 0\n", i, i, i, i);
  };
  for (int i = 1; i < 20; ++i) whole += strand(i);
  const std::string broken_ones[] = {
      "strand 0 numVerts 3 texcoord 0.5 0.25\n0 0 0\n0 1 0\n",                // a row too few
      "strand 0 numVerts 3 texcoord 0.5 0.25\n0 0 0\n0 1 0\n0 2 0\n0 3 0\n",  // a row too many
      "strand 0 numVerts 3 texcoord 0.5 0.25\n0 0 0\n0 one 0\n0 2 0\n",       // no number
      "strand 0 numVerts 3 texcoord 0.5 0.25\n0 0 0\n0 1 0 7\n0 2 0\n",       // a number too many
      "strand zero numVerts 3 texcoord 0.5 0.25\n0 0 0\n0 1 0\n0 2 0\n",      // no strand number
      "strand 0 numVerts 9999 texcoord 0.5 0.25\n0 0 0\n0 1 0\n0 2 0\n",      // too many vertices
      "",                                                                     // not there
  };
  const auto expected = load(header(19, 0) + whole);
  ASSERT_TRUE(expected);
  for (const std::string& broken : broken_ones) {
    SCOPED_TRACE(broken);
    for (const std::string& text : {broken + whole, whole + broken}) {
      const auto stated = load_stated(header(20, 0) + text);
      ASSERT_TRUE(stated) << stated.error().to_string();
      EXPECT_EQ(stated->groom.rest_position_m, expected->rest_position_m);
      EXPECT_EQ(stated->groom.offset, expected->offset);
      EXPECT_EQ(stated->groom.root_uv.size(), 19u);
      EXPECT_THAT(stated->notes, ElementsAre(AllOf(HasSubstr("1 of 20 strands"), HasSubstr("line "))));
    }
  }
  GroomFileOptions options;
  const TemporaryFolder folder;
  options.path = folder.write("one.tfx", header(20, 0) + "strand 0 numVerts 1 texcoord 0 0\n5 5 5\n" + whole);
  const auto placed = load_placed_groom(options);
  ASSERT_TRUE(placed) << placed.error().to_string();
  EXPECT_THAT(placed->notes, Contains(HasSubstr("1 of 20 strands cannot be used")));
}

TEST(TfxText, DecimalCommasAreRead) {
  std::string commas = kTwoStrands;
  std::replace(commas.begin(), commas.end(), '.', ',');
  const auto stated = load_stated(header(2, 0) + commas);
  ASSERT_TRUE(stated) << stated.error().to_string();
  EXPECT_EQ(stated->groom.rest_position_m, load(header(2, 0) + kTwoStrands)->rest_position_m);
  EXPECT_THAT(stated->notes, ElementsAre(HasSubstr("decimal commas")));
}

TEST(TfxText, GarbageIsRefusedWithPrintableErrors) {
  std::string garbage = header(2, 0);
  for (int i = 0; i < 4000; ++i) garbage += static_cast<char>(i * 37 % 256);
  const std::string message = refusal(garbage);
  EXPECT_NE(message, "accepted");
  EXPECT_TRUE(std::all_of(message.begin(), message.end(), [](char c) { return c >= ' ' && c <= '~'; }))
      << message;
  EXPECT_LT(message.size(), 600u);
}

}  // namespace
}  // namespace strandcast::groom_tfx_text_test

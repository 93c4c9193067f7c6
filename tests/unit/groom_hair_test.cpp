// `.hair` files written by the test: every combination of arrays, ragged strands, and everything that can be
// wrong.

#include "common/groom/groom_file.h"
#include "common/groom/hair_loader.h"
#include "tests/support/groom_files.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::groom_hair_test {
namespace {

using test::ByteFile;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr uint32_t kSegments = 1, kPoints = 2, kThickness = 4, kTransparency = 8, kColour = 16;

/// A file with the given arrays; strand s runs along y at x = s.
ByteFile hair_file(const std::vector<uint16_t>& segments, uint32_t arrays, uint32_t default_segments) {
  uint32_t point_count = 0;
  for (const uint16_t count : segments) point_count += count + 1u;
  ByteFile file;
  file.add('H')
      .add('A')
      .add('I')
      .add('R')
      .add(static_cast<uint32_t>(segments.size()))
      .add(point_count)
      .add(arrays);
  file.add(default_segments).add(0.1f).add(0.0f).add(0.5f).add(0.4f).add(0.3f).zeros(88);
  if ((arrays & kSegments) != 0) {
    for (const uint16_t count : segments) file.add(count);
  }
  if ((arrays & kPoints) != 0) {
    for (size_t strand = 0; strand < segments.size(); ++strand) {
      for (uint32_t point = 0; point <= segments[strand]; ++point) {
        file.add(static_cast<float>(strand)).add(static_cast<float>(point)).add(0.0f);
      }
    }
  }
  if ((arrays & kThickness) != 0) file.zeros(point_count * 4);
  if ((arrays & kTransparency) != 0) file.zeros(point_count * 4);
  if ((arrays & kColour) != 0) file.zeros(point_count * 12);
  return file;
}

std::string refusal(const ByteFile& file) {
  static const TemporaryFolder folder;
  const auto path = folder.write("made.hair", file.text());
  const auto groom = load_hair(path);
  if (groom) return "accepted";
  EXPECT_THAT(groom.error().to_string(), HasSubstr(path.string()));
  return groom.error().to_string();
}

TEST(Hair, LoadsEveryCombinationOfArrays) {
  const TemporaryFolder folder;
  for (uint32_t arrays = 0; arrays < 32; ++arrays) {
    const bool has_segments = (arrays & kSegments) != 0;
    const std::vector<uint16_t> segments =
        has_segments ? std::vector<uint16_t>{3, 1, 7} : std::vector<uint16_t>{4, 4, 4};
    const ByteFile file = hair_file(segments, arrays, 4);
    if ((arrays & kPoints) == 0) {
      EXPECT_THAT(refusal(file), HasSubstr("no points"));
      continue;
    }
    const auto stated = load_hair(folder.write("made.hair", file.text()));
    ASSERT_TRUE(stated) << arrays << ": " << stated.error().to_string();
    const Groom& groom = stated->groom;
    ASSERT_EQ(groom.strand_count(), 3u);
    for (uint32_t strand = 0; strand < 3; ++strand) {
      EXPECT_EQ(groom.vertex_count(strand), segments[strand] + 1u);
      EXPECT_EQ(groom.length_m(strand), static_cast<float>(segments[strand]));
      EXPECT_EQ(groom.rest_position_m[groom.offset[strand]], glm::vec3(strand, 0.0f, 0.0f));
      EXPECT_EQ(groom.pinned[groom.offset[strand]], 1);
      EXPECT_EQ(groom.pinned[groom.offset[strand] + 1], 0);
    }
    EXPECT_EQ(groom.uniform_vertex_count(), has_segments ? 0u : 5u);
  }
}

TEST(Hair, AcceptsBothCasesOfTheMagicAndNothingElse) {
  const ByteFile good = hair_file({2, 3}, kSegments | kPoints, 0);
  for (const std::string magic : {"HAIR", "hair"}) {
    ByteFile file = good;
    for (size_t i = 0; i < 4; ++i) file.patch(i, magic[i]);
    EXPECT_EQ(refusal(file), "accepted");
  }
  ByteFile file = good;
  EXPECT_THAT(refusal(file.patch(1, 'X')), HasSubstr("does not begin with 'HAIR'"));
}

TEST(Hair, RaggedGroomsBecomeUniformInHeadSpace) {
  const TemporaryFolder folder;
  GroomFileOptions options;
  options.path = folder.write("made.hair", hair_file({3, 1, 7}, kSegments | kPoints, 0).text());
  options.unit_m = 0.01f;
  options.pinning = Pinning::RootPair;
  auto groom = load_groom(options);
  ASSERT_TRUE(groom) << groom.error().to_string();
  EXPECT_EQ(groom->uniform_vertex_count(), 8u);  // the longest strand keeps its vertices
  EXPECT_NEAR(groom->length_m(2), 0.07f, 1e-6f);
  EXPECT_EQ(groom->pinned[1], 1);
  options.vertex_count = 5;
  groom = load_groom(options);
  ASSERT_TRUE(groom);
  EXPECT_EQ(groom->uniform_vertex_count(), 5u);
  // Longer than the limit: clamped into it.
  options.path = folder.write("long.hair", hair_file({300, 1}, kSegments | kPoints, 0).text());
  options.vertex_count = 0;
  groom = load_groom(options);
  ASSERT_TRUE(groom) << groom.error().to_string();
  EXPECT_EQ(groom->uniform_vertex_count(), kMaxVertexCount);
}

TEST(Hair, WithMoreThanATenthMissingOrTooMuchItIsRefused) {
  const ByteFile whole = hair_file({3, 1, 7}, 31, 0);
  for (size_t size = 0; size < whole.bytes.size(); ++size) {
    ByteFile cut = whole;
    cut.bytes.resize(size);
    ASSERT_EQ(refusal(cut) == "accepted", 10 * size >= 9 * whole.bytes.size()) << size;
  }
  ByteFile padded = whole;
  EXPECT_EQ(refusal(padded.zeros(1)), "accepted");
  EXPECT_THAT(refusal(padded.zeros(whole.bytes.size() / 8)),
              HasSubstr(fmt::format("{} bytes, but 3 strands", whole.bytes.size() * 9 / 8 + 1)));
}

TEST(Hair, WrongHeaderFieldsAreNamed) {
  const ByteFile good = hair_file({3, 1, 7}, kSegments | kPoints, 0);
  const auto changed = [&](size_t offset, uint32_t value) {
    ByteFile file = good;
    return refusal(file.patch(offset, value));
  };
  EXPECT_THAT(changed(4, 0), HasSubstr("0 strands"));
  EXPECT_THAT(changed(4, 0xffffffffu), HasSubstr("4294967295 strands, at most 200000"));
  EXPECT_THAT(changed(4, 4), HasSubstr("need 15 points, there are 13"));
  EXPECT_THAT(changed(8, 0), HasSubstr("0 points"));
  EXPECT_THAT(changed(8, 0xffffffffu), HasSubstr("4294967295 points, at most 16000000"));
  EXPECT_THAT(changed(8, 9), HasSubstr("9 points"));
  EXPECT_THAT(changed(12, 0x103), HasSubstr("array bits 0x103"));
  EXPECT_THAT(changed(12, 0xffffffffu), HasSubstr("array bits 0xffffffff"));
  EXPECT_THAT(changed(12, kSegments), HasSubstr("no points"));
}

TEST(Hair, SegmentsThatDoNotAddUpAreNamed) {
  ByteFile file = hair_file({3, 1, 7}, kSegments | kPoints, 0);
  EXPECT_THAT(refusal(file.patch(128, uint16_t{5})), HasSubstr("need 16 points, there are 14"));
  EXPECT_THAT(refusal(file.patch(128, uint16_t{1})), HasSubstr("need 12 points, there are 14"));
  EXPECT_THAT(refusal(file.patch(130, uint16_t{0xffff})),
              HasSubstr("strand 1 has 65535 segments, at most 4095 are allowed"));
  ByteFile defaults = hair_file({4, 4}, kPoints, 0xffffffffu);
  EXPECT_THAT(refusal(defaults), HasSubstr("strand 0 has 4294967295 segments"));
  defaults = hair_file({4, 4}, kPoints, 3);
  EXPECT_THAT(refusal(defaults), HasSubstr("need 8 points, there are 10"));
}

}  // namespace
}  // namespace strandcast::groom_hair_test

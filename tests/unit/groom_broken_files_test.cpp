// Broken groom files: whatever is wrong, the loader says so in one sentence that names the file and the
// value, and no allocation is larger than what the file's real size explains.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <tuple>

#include "common/base/file.h"
#include "common/base/hash.h"
#include "common/groom/groom_file.h"
#include "common/groom/hair_loader.h"
#include "common/groom/tfx_loader.h"
#include "common/groom/usable_strands.h"
#include "tests/support/bounded_work.h"
#include "tests/support/groom_files.h"
#include "tests/support/largest_allocation.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::groom_broken_files_test {
namespace {

using test::ByteFile;
using test::shared_data;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr size_t kSmallAllocations = 64 << 10;  // messages, streams, paths
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// The error message of loading `file` under `name`, or "accepted". Checks the law on allocations and that
/// the file is named.
std::string refusal(const TemporaryFolder& folder, const ByteFile& file, const std::string& name) {
  const auto path = folder.write(name, file.text());
  test::reset_largest_allocation();
  GroomFileOptions options;
  options.path = path;
  options.unit_m = 0.01f;
  const auto groom = load_groom(options);
  EXPECT_LE(test::largest_allocation_bytes(), file.bytes.size() + kSmallAllocations);
  if (groom) return "accepted";
  EXPECT_THAT(groom.error().to_string(), HasSubstr(path.string()));
  EXPECT_EQ(groom.error().to_string().find('\n'), std::string::npos);
  return groom.error().to_string();
}

ByteFile read_real(const char* name) {
  const auto bytes = load_file(shared_data() / "grooms" / name, kMaxGroomFileBytes);
  return {bytes ? *bytes : std::vector<std::byte>{}};
}

/// Version 4 with two strands of four vertices, root coordinates, and one pinned vertex each.
ByteFile small_v4() {
  ByteFile file;
  file.add(4.0f).add(2u).add(4u).add(160u).add(160u + 2 * 4 * 16).add(0u).add(0u).add(0u).zeros(128);
  for (int strand = 0; strand < 2; ++strand) {
    for (int vertex = 0; vertex < 4; ++vertex) {
      file.add(static_cast<float>(strand))
          .add(static_cast<float>(vertex))
          .add(0.5f)
          .add(vertex == 0 ? 0.0f : 1.0f);
    }
  }
  for (const float uv : {0.1f, 0.2f, 0.3f, 0.4f}) file.add(uv);
  return file;
}

/// Version 3 with two strands of `vertex_count` vertices.
ByteFile small_v3(uint32_t vertex_count, int32_t both_ends) {
  ByteFile file;
  file.add(3.0f).add(2u).add(vertex_count).add(0u).add(both_ends).zeros(124).add(296u).zeros(296 - 148);
  for (uint32_t i = 0; i < 2 * vertex_count; ++i) file.add(0.0f).add(static_cast<float>(i)).add(0.25f);
  return file;
}

TEST(BrokenTfx, TheSmallFilesThatTestsBreakAreGood) {
  const ByteFile four = small_v4();
  const auto v4 = read_tfx_binary(ByteView(four.bytes));
  ASSERT_TRUE(v4) << v4.error().to_string();
  EXPECT_EQ(v4->groom.rest_position_m[6], glm::vec3(1.0f, 2.0f, 0.5f));
  EXPECT_EQ(v4->groom.root_uv[1], glm::vec2(0.3f, 0.4f));
  EXPECT_EQ(v4->groom.pinned, (std::vector<uint8_t>{1, 0, 0, 0, 1, 0, 0, 0}));
  const ByteFile three = small_v3(6, 1);
  const auto v3 = read_tfx_binary(ByteView(three.bytes));
  ASSERT_TRUE(v3) << v3.error().to_string();
  EXPECT_EQ(v3->groom.pinned, (std::vector<uint8_t>{1, 1, 0, 0, 1, 1, 1, 1, 0, 0, 1, 1}));
  EXPECT_EQ(v3->groom.rest_position_m[7], glm::vec3(0.0f, 7.0f, 0.25f));
}

TEST(BrokenTfx, OfRealFilesATenthMayBeMissingOrTooMuch) {
  REQUIRE_SHARED_DATA();
  const TemporaryFolder folder;
  for (const char* name :
       {"Ratboy_mohawk.tfx", "TestHair1.tfx", "ponytail_side.tfx", "sintel_11400x16.tfx"}) {
    const ByteFile whole = read_real(name);
    ASSERT_GT(whole.bytes.size(), 300u);
    for (const size_t size : {size_t{0}, size_t{3}, size_t{4}, size_t{159}, size_t{160}, size_t{295},
                              size_t{296}, whole.bytes.size() / 2, whole.bytes.size() * 8 / 9}) {
      ByteFile cut = whole;
      cut.bytes.resize(size);
      ASSERT_NE(refusal(folder, cut, name), "accepted") << name << " cut to " << size;
    }
    ByteFile cut = whole, padded = whole;
    cut.bytes.pop_back();
    EXPECT_EQ(refusal(folder, cut, name), "accepted") << name;
    EXPECT_EQ(refusal(folder, padded.zeros(5), name), "accepted") << name;
    EXPECT_THAT(refusal(folder, padded.zeros(whole.bytes.size() / 8), name),
                HasSubstr("bytes are left after the last array"));
  }
}

TEST(BrokenTfx, WrongHeaderFieldsOfRealFilesAreNamed) {
  REQUIRE_SHARED_DATA();
  const TemporaryFolder folder;
  const ByteFile mohawk = read_real("Ratboy_mohawk.tfx"), test_hair = read_real("TestHair1.tfx");
  struct Change {
    bool is_v4;
    size_t offset;
    uint32_t value;
    const char* expected;
  };
  const std::vector<Change> changes = {
      {true, 4, 0u, "0 strands"},
      {true, 4, 0xffffffffu, "4294967295 strands, at most 200000"},
      {true, 4, 200'001u, "200001 strands, at most 200000"},
      {true, 4, 200'000u, "6400000 x 16 bytes of vertex positions at offset 160 do not fit"},
      {true, 4, 2229u, "overlaps"},  // the larger array reaches into the next one
      {true, 8, 0u, "0 vertices per strand, allowed are 2 to 4096"},
      {true, 8, 1u, "1 vertices per strand"},
      {true, 8, 0x80000000u, "2147483648 vertices per strand"},
      {true, 12, 0u, "offset of the vertex positions is 0"},
      {true, 12, 159u, "offset 159 of the vertex positions overlaps"},
      {true, 12, 0xfffffff0u, "at offset 4294967280 do not fit into 1158720 bytes"},
      {true, 16, 160u, "overlaps"},
      {true, 16, 0xffffffffu, "at offset 4294967295 do not fit"},
      {true, 20, 0x7fffffffu, "vertex coordinates at offset 2147483647 do not fit"},
      {true, 24, 1u, "offset 1 of the strand thickness overlaps"},
      {true, 28, 1'158'719u, "vertex colours"},
      {false, 4, 0u, "0 strands"},
      {false, 4, 0x80000000u, "2147483648 strands"},
      {false, 8, 0xffffu, "65535 vertices per strand"},
      {false, 16, 2u, "both-ends flag is 2"},
      {false, 16, 0xffffffffu, "both-ends flag is -1"},
      {false, 144, 0u, "offset of the vertex positions is 0"},
      {false, 144, 295u, "offset 295 of the vertex positions overlaps"},
      {false, 144, 297u, "at offset 297 do not fit into 481592 bytes"},
      {false, 148, 0xfffffff0u, "strand thickness at offset 4294967280 do not fit"},
      {false, 152, 400u, "overlaps"},
  };
  for (const Change& change : changes) {
    ByteFile broken = change.is_v4 ? mohawk : test_hair;
    EXPECT_THAT(refusal(folder, broken.patch(change.offset, change.value), "broken.tfx"),
                HasSubstr(change.expected))
        << "byte " << change.offset << " set to " << change.value;
  }
}

TEST(BrokenTfx, UnknownVersionsNameTheKnownOnes) {
  const TemporaryFolder folder;
  for (const float version : {0.0f, 1.0f, 2.0f, 2.99f, 5.0f, -4.0f, 1e30f, kNan}) {
    ByteFile broken = small_v4();
    EXPECT_THAT(refusal(folder, broken.patch(0, version), "broken.tfx"),
                AllOf(HasSubstr(fmt::format("version {},", version)), HasSubstr("known are 4 and 3")));
  }
}

TEST(BrokenTfx, NonFiniteValuesNameStrandAndVertex) {
  const TemporaryFolder folder;
  for (const float value : {kNan, HUGE_VALF, -HUGE_VALF}) {
    ByteFile broken = small_v4();
    EXPECT_THAT(
        refusal(folder, broken.patch(160 + 6 * 16 + 4, value), "broken.tfx"),
        HasSubstr(fmt::format("strand 1 vertex 2 has the coordinates 1, {} and 0.5; 1 of 2 strands", value)));
    broken = small_v4();
    EXPECT_THAT(refusal(folder, broken.patch(160 + 6 * 16 + 12, value), "broken.tfx"),
                HasSubstr(fmt::format("has the inverse mass {}", value)));
  }
  ByteFile broken = small_v4();
  EXPECT_THAT(refusal(folder, broken.patch(160 + 12, -1.0f), "broken.tfx"), HasSubstr("inverse mass -1"));
  // Finite, but farther away than any head: the unit must be wrong.
  broken = small_v4();
  EXPECT_THAT(refusal(folder, broken.patch(160 + 2 * 16, 3e38f), "broken.tfx"),
              AllOf(HasSubstr("strand 0 vertex 2"), HasSubstr("check the unit")));
}

TEST(BrokenTfx, MassesThatAreNoneHoldNothing) {
  for (const float mass : {kNan, HUGE_VALF, -1.0f}) {
    SCOPED_TRACE(mass);
    ByteFile file;
    file.add(4.0f).add(3u).add(4u).add(160u).zeros(144);
    for (int i = 0; i < 12; ++i)
      file.add(static_cast<float>(i / 4)).add(static_cast<float>(i)).add(0.0f).add(i % 4 == 0 ? 0.0f : 1.0f);
    const auto free = read_tfx_binary(ByteView(file.bytes));
    ASSERT_TRUE(free);
    EXPECT_TRUE(free->notes.empty());
    for (const size_t bad : {size_t{4}, size_t{6}}) {  // a root, and another
      ByteFile broken = file;
      const auto stated = read_tfx_binary(ByteView(broken.patch(160 + 16 * bad + 12, mass).bytes));
      ASSERT_TRUE(stated) << stated.error().to_string();
      EXPECT_EQ(stated->groom.pinned, free->groom.pinned);
      EXPECT_THAT(stated->notes, ElementsAre(AllOf(HasSubstr("1 of 12 vertices"),
                                                   HasSubstr(fmt::format("strand 1 vertex {}", bad % 4)))));
    }
    file.patch(160 + 16 * 5 + 12, mass).patch(160 + 16 * 6 + 12, mass);
    EXPECT_FALSE(read_tfx_binary(ByteView(file.bytes))) << "more than a tenth";
  }
}

TEST(BrokenTfx, CoordinatesOfRootsAreNoReasonToRefuseHair) {
  StatedGroom hair;
  hair.groom.offset = {0};
  for (int strand = 0; strand < 20; ++strand) {
    const auto x = static_cast<float>(strand);
    hair.groom.rest_position_m.insert(hair.groom.rest_position_m.end(), {{x, 0, 0}, {x, 1, 0}});
    hair.groom.offset.push_back(static_cast<uint32_t>(hair.groom.rest_position_m.size()));
    hair.groom.root_uv.emplace_back(0.01f * x, 0.5f);
  }
  hair.groom = with_pinning(std::move(hair.groom), Pinning::Root);
  hair.groom.root_uv[19].x = kNan;
  hair.groom.root_uv[3].y = HUGE_VALF;
  const auto bridged = with_usable_strands(hair);
  ASSERT_TRUE(bridged) << bridged.error().to_string();
  EXPECT_EQ(bridged->groom.root_uv[19], glm::vec2(0.01f * 18.0f, 0.5f)) << "of the nearest root";
  EXPECT_THAT(bridged->groom.root_uv[3].x, ::testing::AnyOf(0.02f, 0.04f));
  EXPECT_THAT(bridged->notes,
              Contains(HasSubstr("2 of 20 root coordinates cannot be used, the first that of strand 3")));
  hair.groom.root_uv[7].x = kNan;
  const auto without = with_usable_strands(hair);
  ASSERT_TRUE(without) << without.error().to_string();
  EXPECT_TRUE(without->groom.root_uv.empty()) << "more than a tenth";
  const TemporaryFolder folder;
  EXPECT_EQ(refusal(folder, small_v4().patch(160 + 8 * 16 + 8, kNan), "uv.tfx"), "accepted");
}

// Parts of one head of hair, of which some are held at their tips too.
TEST(BrokenTfx, PartsAreHeldEachAsItSays) {
  const TemporaryFolder folder;
  GroomFileOptions options;
  options.unit_m = 0.01f;
  options.path = folder.write("both_ends.tfx", small_v3(6, 1).text());
  EXPECT_EQ(load_groom(options)->pinned, (std::vector<uint8_t>{1, 1, 0, 0, 1, 1, 1, 1, 0, 0, 1, 1}));
  options.more_paths = {folder.write("free_tips.tfx", small_v3(6, 0).text())};
  const auto placed = load_placed_groom(options);
  ASSERT_TRUE(placed) << placed.error().to_string();
  ASSERT_EQ(placed->groom.strand_count(), 4u);
  for (uint32_t strand = 0; strand < 4; ++strand)
    for (uint32_t vertex = 0; vertex < 6; ++vertex)
      EXPECT_EQ(placed->groom.pinned[6 * strand + vertex], vertex < 2 || (strand < 2 && vertex > 3) ? 1 : 0)
          << strand << ' ' << vertex;
  EXPECT_THAT(placed->notes, Contains("the tips of 2 of 4 strands are held, the others are free"));
  options.pinning = Pinning::BothEnds;
  EXPECT_EQ(load_groom(options)->pinned[6 * 3 + 5], 1) << "stated";
}

TEST(BrokenTfx, GuidesOfVersionThreeAreNoHair) {
  ByteFile file = small_v3(6, 1);
  const auto flags_at = static_cast<uint32_t>(file.bytes.size());
  file.add(1u).add(0u);
  file = file.patch(160, flags_at);
  const auto hair = read_tfx_binary(ByteView(file.bytes));
  ASSERT_TRUE(hair) << hair.error().to_string();
  EXPECT_EQ(hair->groom.strand_count(), 1u);
  EXPECT_EQ(hair->groom.rest_position_m[0], glm::vec3(0.0f, 6.0f, 0.25f));
  EXPECT_EQ(hair->groom.pinned, (std::vector<uint8_t>{1, 1, 0, 0, 1, 1}));
  EXPECT_THAT(hair->notes, Contains("1 guide is left out (groom.file.guides takes guides alone)"));
  const auto guides = read_tfx_binary(ByteView(file.bytes), GuideUse::Alone);
  EXPECT_EQ(guides->groom.rest_position_m[0], glm::vec3(0.0f, 0.0f, 0.25f));
}

TEST(BrokenTfx, ARootIsPinnedWhateverItsFlagSays) {
  const ByteFile file = small_v4().patch(160 + 12, 1.0f);
  const auto groom = read_tfx_binary(ByteView(file.bytes));
  ASSERT_TRUE(groom);
  EXPECT_EQ(groom->groom.pinned[0], 1);
}

/// Random damage to the header: the loader either refuses or gives a groom that fits the file.
TEST(BrokenTfx, RandomHeadersNeverGiveAGroomLargerThanTheFile) {
  for (uint32_t round = 0; round < 20'000; ++round) {
    ByteFile file = round % 2 == 0 ? small_v4() : small_v3(4, 0);
    for (uint32_t change = 0; change < 1 + round % 3; ++change) {
      const uint32_t hash = mix_u32(round * 4 + change);
      file.patch(hash % 176, static_cast<uint8_t>(mix_u32(hash)));
    }
    test::reset_largest_allocation();
    const auto groom = read_tfx_binary(ByteView(file.bytes));
    ASSERT_LE(test::largest_allocation_bytes(), file.bytes.size() + kSmallAllocations);
    ASSERT_LE(groom ? groom->groom.rest_position_m.size() * 12 : 0, file.bytes.size());
  }
}

TEST(BrokenTfx, AFileThatHoldsAllItsHairIsTold) {
  const TemporaryFolder folder;
  ByteFile file = small_v4();
  GroomFileOptions options;
  options.unit_m = 0.01f;
  const auto notes = [&] {
    options.path = folder.write("a.tfx", file.text());
    return load_placed_groom(options)->notes;
  };
  EXPECT_THAT(notes(), Not(Contains(HasSubstr("holds every vertex"))));
  for (size_t vertex = 0; vertex < 8; ++vertex) file.patch(160 + 16 * vertex + 12, 0.0f);
  EXPECT_THAT(notes(), Contains(HasSubstr("holds every vertex")));
  options.unit_m = 1000.0f;
  EXPECT_THAT(load_placed_groom(options).error().to_string(), HasSubstr("groom.file.unit_m="));
}

// The counter-example: work that never ends, and work that takes all memory, are seen to.
TEST(BrokenTfx, NoRealFileThatIsBrokenCostsMuch) {
  constexpr test::WorkBounds kLittle{64 << 20, 1};
  const auto run_away = [] {
    for (std::atomic<uint64_t> count = 0;;) ++count;
  };
  EXPECT_THAT(test::beyond_bounds(run_away, kLittle), HasSubstr("1 s of processor time"));
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  const auto take_all = [] { EXPECT_EQ(std::vector<char>(1 << 30, 'x').back(), 'x'); };
  EXPECT_THAT(test::beyond_bounds(take_all, kLittle), HasSubstr("67108864 bytes"));
#endif
  REQUIRE_SHARED_DATA();
  const TemporaryFolder folder;
  uint32_t random = 1;
  for (const char* name : {"Ratboy_mohawk.tfx", "TestHair1.tfx", "ponytail_side.tfx"}) {
    const ByteFile whole = read_real(name);
    for (int trial = 0; trial < 8; ++trial) {
      ByteFile broken = whole;
      for (int i = 0; i < 8; ++i) {
        random = mix_u32(random + 1);
        const bool is_in_header = i < 2;
        const size_t at = random % (is_in_header ? 296 : broken.bytes.size() - 4) / 4 * 4;
        broken.patch(at, mix_u32(random));
      }
      GroomFileOptions options;
      options.path = folder.write(name, broken.text());
      EXPECT_EQ(test::beyond_bounds([&] { (void)load_placed_groom(options); }), "") << name << trial;
    }
  }
}

TEST(GroomFile, NamesTheKnownExtensionsAndWrongOptions) {
  const TemporaryFolder folder;
  const ByteFile file = small_v4();
  EXPECT_THAT(
      refusal(folder, file, "groom.xyz"),
      AllOf(HasSubstr("'.xyz'"), HasSubstr("known: .tfx, .hair, .ply, .usd, .usda, .usdc, .usdz, .abc")));
  EXPECT_THAT(refusal(folder, file, "groom"),
              HasSubstr("known: .tfx, .hair, .ply, .usd, .usda, .usdc, .usdz, .abc"));
  GroomFileOptions options;
  options.path = folder.path() / "missing.tfx";
  EXPECT_EQ(load_groom(options).error().code, ErrorCode::NotFound);
  options.path = folder.write("good.TFX", file.text());
  EXPECT_TRUE(load_groom(options));
  for (const float unit_m : {-1.0f, kNan, HUGE_VALF}) {
    options.unit_m = unit_m;
    EXPECT_THAT(load_groom(options).error().to_string(),
                AllOf(HasSubstr("good.TFX"), HasSubstr("unit_m is")));
  }
  options.unit_m = 1.0f;
  options.vertex_count = 65;
  EXPECT_THAT(load_groom(options).error().message, HasSubstr("vertex_count is 65"));
  options.vertex_count = 0;
  options.origin = glm::vec3(0.0f, kNan, 0.0f);
  EXPECT_THAT(load_groom(options).error().message, HasSubstr("origin is (0, nan, 0)"));
}

TEST(GroomFile, TurnsMovesAndScalesInThatOrder) {
  const TemporaryFolder folder;
  ByteFile file = small_v4();
  file.patch(160 + 16, 1.0f).patch(160 + 20, 2.0f).patch(160 + 24, 3.0f);  // strand 0 vertex 1
  GroomFileOptions options;
  options.path = folder.write("a.tfx", file.text());
  options.unit_m = 0.1f;
  options.origin = glm::vec3(0.0f, 1.0f, 0.0f);
  const auto upright = load_groom(options);
  ASSERT_TRUE(upright);
  EXPECT_NEAR(glm::distance(upright->rest_position_m[1], glm::vec3(0.1f, 0.1f, 0.3f)), 0.0f, 1e-6f);
  options.is_z_up = true;  // the file's +Z becomes +Y, its +Y becomes -Z
  const auto turned = load_groom(options);
  ASSERT_TRUE(turned);
  EXPECT_NEAR(glm::distance(turned->rest_position_m[1], glm::vec3(0.1f, 0.2f, -0.2f)), 0.0f, 1e-6f);
  options.pinning = Pinning::RootPair;
  EXPECT_EQ(load_groom(options)->pinned, (std::vector<uint8_t>{1, 1, 0, 0, 1, 1, 0, 0}));
}

TEST(GroomBrokenFiles, TextUnderTheWrongNameIsCalledText) {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& text, const std::string& name) {
    ByteFile file;
    for (const char c : text) file.bytes.push_back(static_cast<std::byte>(c));
    return refusal(folder, file, name);
  };
  const std::string obj =
      "# Blender v3.6\nv 0.1 0.2 0.3\nv 0.4 0.5 0.6\nl 1 2\n" + std::string(400, '#') + "\n";
  for (const char* name : {"a.tfx", "a.hair"})
    EXPECT_THAT(refused(obj, name),
                AllOf(HasSubstr("this is text, \"# Blender v3.6\""), HasSubstr("is binary")))
        << name;
  EXPECT_THAT(refused("version 2.0\nscale 1.0\nrotation 0 0 0\n", "b.hair"), HasSubstr("call it .tfx"));
  EXPECT_THAT(refused("version 2.0\nscale x\n", "b.tfx"), ::testing::Not(HasSubstr("this is text")))
      << "what it may be is read as that";
  EXPECT_THAT(refused("version https://git-lfs.github.com/spec/v1\noid sha256:00\n", "c.tfx"),
              HasSubstr("Git LFS"));
  EXPECT_THAT(refusal(folder, small_v4(), "d.hair"), HasSubstr("does not begin with 'HAIR'"))
      << "this is no text";
}

// A renamed file is called what it is, and the reader is told what to do with it.
TEST(GroomBrokenFiles, AFileUnderAnotherNameIsCalledWhatItIs) {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& text, const std::string& name) {
    ByteFile file;
    for (const char c : text) file.bytes.push_back(static_cast<std::byte>(c));
    return refusal(folder, file, name);
  };
  for (const char* name : {"a.tfx", "a.hair", "a.ply", "a.abc", "a.usda"})
    EXPECT_THAT(refused("HIERARCHY\nROOT Hips\n{\n", name), HasSubstr("a BVH clip, motion and no hair"))
        << name;
  for (const char* name : {"b.ply", "b.abc", "b.hair"})
    EXPECT_THAT(refused(std::string("\0\0\x80\x40", 4) + std::string(200, '\1'), name),
                HasSubstr("call it .tfx"))
        << name;
  EXPECT_THAT(refused("ply\nformat ascii 1.0\n", "c.hair"), HasSubstr("a .ply file: call it that"));
  EXPECT_THAT(refused("Ogawa" + std::string(40, '\1'), "d.ply"), HasSubstr("Alembic: call it .abc"));
  EXPECT_THAT(refused("Ogawa" + std::string(40, '\1'), "d.abc"), Not(HasSubstr("looks like")));
  EXPECT_THAT(refused("\x1f\x8b" + std::string(40, '\1'), "hair.ply.gz"), HasSubstr("packed by gzip"));
  EXPECT_THAT(refused("ply\nformat ascii 1.0\n", "hair"), HasSubstr("looks like a .ply file"));
  EXPECT_THAT(refused("", "hair.ply"), HasSubstr("it is empty"));
  EXPECT_THAT(refused("noise", "e.ply"), Not(HasSubstr("looks like")));
}

/// Strands of three points; the second point of some is no number, and others show nothing.
struct SomeHair {
  static constexpr uint32_t kStrands = 40, kPoints = 3;
  std::vector<glm::vec3> points;

  SomeHair(std::initializer_list<uint32_t> broken, std::initializer_list<uint32_t> empty) {
    for (uint32_t strand = 0; strand < kStrands; ++strand)
      for (uint32_t i = 0; i < kPoints; ++i)
        points.emplace_back(0.1f * static_cast<float>(strand), -0.5f * static_cast<float>(i), 0.25f);
    for (const uint32_t strand : broken) points[kPoints * strand + 1].y = kNan;
    for (const uint32_t strand : empty)
      for (uint32_t i = 0; i < kPoints; ++i) points[kPoints * strand + i] = points[kPoints * strand];
  }
  std::string lines(const char* before) const {
    std::string text;
    for (size_t i = 0; i < points.size(); ++i)
      text += (i % kPoints == 0 ? before : std::string()) +
              fmt::format("{} {} {}\n", points[i].x, points[i].y, points[i].z);
    return text;
  }
  std::string tfx_text() const {
    std::string text = fmt::format("version 2.0\nnumStrands {}\nis sorted\n", kStrands);
    for (uint32_t strand = 0; strand < kStrands; ++strand) {
      text += fmt::format("strand {} numVerts {} texcoord 0 0\n", strand, kPoints);
      for (uint32_t i = 0; i < kPoints; ++i) {
        const glm::vec3& p = points[kPoints * strand + i];
        text += fmt::format("{} {} {}\n", p.x, std::isnan(p.y) ? "-1.#IND" : fmt::format("{}", p.y), p.z);
      }
    }
    return text;
  }
  std::string tfx() const {
    ByteFile file;
    file.add(4.0f).add(kStrands).add(kPoints).add(160u).zeros(144);
    for (const glm::vec3& p : points) file.add(p.x).add(p.y).add(p.z).add(1.0f);
    return file.text();
  }
  std::string hair() const {
    ByteFile file;
    file.add('H').add('A').add('I').add('R').add(kStrands).add(kStrands * kPoints).add(2u).add(kPoints - 1);
    file.zeros(128 - file.bytes.size());
    for (const glm::vec3& p : points) file.add(p.x).add(p.y).add(p.z);
    return file.text();
  }
  std::string ply() const {
    std::string text = fmt::format(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
        "element strand {}\nproperty uchar nsegs\nend_header\n",
        points.size(), kStrands);
    text += lines("");
    for (uint32_t strand = 0; strand < kStrands; ++strand) text += "2\n";
    return text;
  }
  std::string usda() const {
    std::string text = "#usda 1.0\ndef BasisCurves \"Hair\"\n{\nuniform token type = \"linear\"\n", counts;
    for (uint32_t strand = 0; strand < kStrands; ++strand) counts += fmt::format("{}, ", kPoints);
    text += "int[] curveVertexCounts = [" + counts + "]\npoint3f[] points = [";
    for (const glm::vec3& p : points) text += fmt::format("({}, {}, {}), ", p.x, p.y, p.z);
    return text + "]\n}\n";
  }
};

// One rule for all formats.
TEST(BrokenStrands, ATenthMayBeBrokenAndIsLeftOutAndCounted) {
  const TemporaryFolder folder;
  for (const auto& [name, text_of] : std::vector<std::pair<const char*, std::string (SomeHair::*)() const>>{
           {"text.tfx", &SomeHair::tfx_text},
           {"a.tfx", &SomeHair::tfx},
           {"a.hair", &SomeHair::hair},
           {"a.ply", &SomeHair::ply},
           {"a.usda", &SomeHair::usda}}) {
    GroomFileOptions options;
    options.unit_m = 0.1f;
    const auto loaded = [&](const SomeHair& hair) {
      options.path = folder.write(name, (hair.*text_of)());
      return load_placed_groom(options);
    };
    const auto most = loaded({{3, 4, 20, 39}, {0, 1, 2, 5}});
    ASSERT_TRUE(most) << name << most.error().to_string();
    EXPECT_EQ(most->groom.strand_count(), 32u) << name;
    const SomeHair good({}, {});
    EXPECT_EQ(most->groom.rest_position_m[SomeHair::kPoints], 0.1f * good.points[7 * SomeHair::kPoints])
        << name;
    EXPECT_THAT(most->notes,
                Contains(HasSubstr("4 of 40 strands cannot be used, and are left out; the first: strand 3 "
                                   "vertex 1 has the coordinates ")));
    EXPECT_THAT(most->notes, Contains(HasSubstr("4 of 40 strands cannot be used, and are left out; the "
                                                "first: strand 0 has fewer than 2 points, or no length")));
    EXPECT_THAT(loaded({{}, {0, 1, 2, 5, 6}}).error().to_string(),
                HasSubstr("5 of 40 strands cannot be used, a tenth at most"));
    const auto more = loaded({{3, 4, 20, 38, 39}, {}});
    ASSERT_FALSE(more) << name;
    EXPECT_THAT(more.error().to_string(),
                AllOf(HasSubstr(name), HasSubstr("5 of 40 strands cannot be used, a tenth at most")));
  }
}

TEST(BrokenStrands, OfAFileThatIsCutOffWhatIsWholeComesIn) {
  const TemporaryFolder folder;
  const SomeHair hair({}, {});
  const auto occurrences = [](std::string_view text, std::string_view of) {
    size_t count = 0;
    for (size_t at = text.find(of); at != std::string_view::npos; at = text.find(of, at + of.size())) ++count;
    return count;
  };
  using Whole = std::function<size_t(const std::string& text)>;  // points that this much of the text has
  const auto after = [](size_t header, size_t bytes) {
    return [=](const std::string& text) { return text.size() < header ? 0 : (text.size() - header) / bytes; };
  };
  const std::vector<std::tuple<const char*, std::string, Whole>> formats = {
      {"a.tfx", hair.tfx(), after(160, 16)},
      {"a.hair", hair.hair(), after(128, 12)},
      {"a.usda", hair.usda(), [&](const std::string& text) { return occurrences(text, "),"); }}};
  for (const auto& [name, text, whole_points] : formats) {
    size_t accepted = 0;
    for (size_t size = text.size() - 2; size > 0;
         size -= std::min<size_t>(size, size > text.size() * 7 / 8 ? 1 : 97)) {
      const std::string cut = text.substr(0, size);
      const size_t whole = whole_points(cut) / SomeHair::kPoints;
      GroomFileOptions options;
      options.unit_m = 0.1f;
      options.path = folder.write(name, cut);
      const auto loaded = load_placed_groom(options);
      ASSERT_EQ(loaded.ok(), 10 * whole >= 9 * SomeHair::kStrands)
          << name << ' ' << size << (loaded ? "" : loaded.error().to_string());
      if (!loaded) continue;
      ++accepted;
      ASSERT_EQ(loaded->groom.strand_count(), whole) << name << ' ' << size;
      ASSERT_EQ(loaded->groom.rest_position_m.back(), 0.1f * hair.points[SomeHair::kPoints * whole - 1]);
      ASSERT_THAT(loaded->notes, Contains(HasSubstr("cut off"))) << name << ' ' << size;
    }
    EXPECT_GT(accepted, 50u) << name;
  }
}

// A count in the middle that is wrong makes criss-cross of all that follows. The counter-example is cut off.
TEST(BrokenStrands, ACountThatIsWrongIsNoPointThatIsLeftOver) {
  constexpr uint32_t kPoints = 8;
  std::vector<glm::vec3> points;
  for (uint32_t i = 0; i < 40 * kPoints; ++i)
    points.emplace_back(i / kPoints % 8, 0.25f * static_cast<float>(i % kPoints), i / kPoints / 8);
  std::vector<uint32_t> counts(40, kPoints);
  std::vector<std::string> notes;
  std::vector<glm::vec3> cut(points.begin(), points.end() - 2), fit = points;
  EXPECT_TRUE(fit_points(cut, counts, "counts", notes));
  for (const uint32_t wrong : {kPoints - 1, kPoints + 1}) {
    counts[15] = wrong;
    const Status status = fit_points(fit, counts, "counts", notes);
    ASSERT_FALSE(status) << wrong;
    EXPECT_THAT(status.error().to_string(), HasSubstr("of 40 strands lead on to the next: a count is wrong"));
  }
  EXPECT_EQ(fit, points);
}

// The counter-example is hair that begins at the origin.
TEST(BrokenStrands, APointThatWasLeftAtTheOriginCostsItsStrand) {
  StatedGroom stated;
  stated.groom.offset = {0};
  for (uint32_t strand = 0; strand < 40; ++strand) {
    for (uint32_t i = 0; i < 8; ++i)
      stated.groom.rest_position_m.emplace_back(0.01f * static_cast<float>(strand),
                                                1.5f - 0.02f * static_cast<float>(i), 0.0f);
    stated.groom.offset.push_back(8 * strand + 8);
  }
  stated.groom.pinned.assign(320, 0);
  StatedGroom at_origin = stated;
  for (glm::vec3& point : at_origin.groom.rest_position_m) point.y -= 1.5f;
  EXPECT_EQ(with_usable_strands(at_origin)->groom.strand_count(), 40u);
  stated.groom.rest_position_m[8 * 5 + 3] = glm::vec3(0.0f);
  std::fill_n(stated.groom.rest_position_m.begin() + 8 * 9 + 4, 4, glm::vec3(0.0f));
  const auto usable = with_usable_strands(stated);
  ASSERT_TRUE(usable) << usable.error().to_string();
  EXPECT_EQ(usable->groom.strand_count(), 38u);
  EXPECT_THAT(usable->notes, Contains(HasSubstr("strand 5 vertex 3 is at 0, 0, 0, far from its strand")));
}

// As one that a program left where it was made. The counter-example is half of the hair elsewhere.
TEST(BrokenStrands, AStrandThatGrowsApartIsNoHairOfThisHead) {
  const auto usable = [](uint32_t apart_count) {
    StatedGroom stated;
    stated.groom.offset = {0};
    for (uint32_t strand = 0; strand < 40; ++strand) {
      const float height_m = strand < apart_count ? 0.1f : 1.5f;
      for (uint32_t i = 0; i < 8; ++i)
        stated.groom.rest_position_m.emplace_back(0.01f * static_cast<float>(strand),
                                                  height_m - 0.02f * static_cast<float>(i), 0.0f);
      stated.groom.offset.push_back(8 * strand + 8);
    }
    stated.groom.pinned.assign(320, 0);
    return with_usable_strands(std::move(stated));
  };
  EXPECT_EQ(usable(0)->groom.strand_count(), 40u);
  EXPECT_EQ(usable(1)->groom.strand_count(), 39u);
  EXPECT_THAT(usable(1)->notes, Contains(HasSubstr("strand 0 grows 1.41")));
  EXPECT_EQ(usable(20)->groom.strand_count(), 40u);
}

TEST(BrokenStrands, APointFarFromAllHairCostsItsStrandAlone) {
  const TemporaryFolder folder;
  GroomFileOptions options;
  options.unit_m = 0.1f;
  const auto loaded = [&](uint32_t far_count, float x) {
    SomeHair hair({}, {});
    for (uint32_t strand = 0; strand < far_count; ++strand)
      hair.points[(7 + 3 * strand) * SomeHair::kPoints + 1].x = x;
    options.path = folder.write("far.ply", hair.ply());
    return load_placed_groom(options);
  };
  const auto whole = loaded(0, 0.0f);
  ASSERT_TRUE(whole) << whole.error().to_string();
  for (const float x : {2.5e3f, -1e20f}) {
    const auto one = loaded(1, x);
    ASSERT_TRUE(one) << one.error().to_string();
    EXPECT_EQ(one->groom.strand_count(), whole->groom.strand_count() - 1);
    EXPECT_THAT(one->notes, Contains(AllOf(HasSubstr("1 of 40 strands cannot be used, and are left out"),
                                           HasSubstr("strand 7 goes "))));
  }
  // A quarter of all is no accident.
  EXPECT_EQ(loaded(10, 600.0f)->groom.strand_count(), whole->groom.strand_count());
}

}  // namespace
}  // namespace strandcast::groom_broken_files_test

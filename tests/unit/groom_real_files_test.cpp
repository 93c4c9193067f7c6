// Every real groom and mesh loads with the facts that shared/data/FORMATS.md and ORIGINS.md state about it.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/groom/groom_file.h"
#include "common/groom/hair_loader.h"
#include "common/groom/mesh.h"
#include "common/groom/tfx_loader.h"
#include "tests/support/groom_files.h"

namespace strandcast::groom_real_files_test {
namespace {

using test::shared_data;

std::vector<float> sorted_lengths(const Groom& groom) {
  std::vector<float> lengths(groom.strand_count());
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand) lengths[strand] = groom.length_m(strand);
  std::sort(lengths.begin(), lengths.end());
  return lengths;
}

/// Pinned vertices at the root of every strand, or -1 when strands differ or others are pinned too.
int pins_per_root(const Groom& groom) {
  int common = -1;
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand) {
    const auto begin = groom.pinned.begin() + groom.offset[strand],
               end = groom.pinned.begin() + groom.offset[strand + 1];
    const auto free = std::find(begin, end, uint8_t{0});
    const int count = static_cast<int>(free - begin);
    if (std::find(free, end, uint8_t{1}) != end || (strand > 0 && count != common)) return -1;
    common = count;
  }
  return common;
}

/// What the loader makes of a file, before any unit or axis.
Result<Groom> read_strands(const char* name) {
  ASSIGN_OR_RETURN(StatedGroom stated, load_tfx(shared_data() / "grooms" / name));
  return std::move(stated.groom);
}

TEST(RealGroom, MohawkHasItsCountsPinsAndShortestStrand) {
  REQUIRE_SHARED_DATA();
  const auto groom = read_strands("Ratboy_mohawk.tfx");
  ASSERT_TRUE(groom) << groom.error().to_string();
  EXPECT_EQ(groom->strand_count(), 2228u);
  EXPECT_EQ(groom->uniform_vertex_count(), 32u);
  EXPECT_EQ(pins_per_root(*groom), 2);
  EXPECT_EQ(groom->root_uv.size(), 2228u);
  EXPECT_EQ(groom->name, "Ratboy_mohawk");
  const auto lengths = sorted_lengths(*groom);
  EXPECT_NEAR(lengths[0], 7.5e-6f, 0.05e-6f);
  EXPECT_NEAR(lengths[1], 5.6e-5f, 0.05e-5f);
}

TEST(RealGroom, SintelHasItsCountsSinglePinAndMedianLength) {
  REQUIRE_SHARED_DATA();
  const auto groom = read_strands("sintel_11400x16.tfx");
  ASSERT_TRUE(groom) << groom.error().to_string();
  EXPECT_EQ(groom->strand_count(), 11400u);
  EXPECT_EQ(groom->uniform_vertex_count(), 16u);
  EXPECT_EQ(pins_per_root(*groom), 1);
  const auto lengths = sorted_lengths(*groom);
  EXPECT_NEAR(lengths[lengths.size() / 2], 0.10f, 0.005f);
}

TEST(RealGroom, TestHairHasStrandsOfLengthEleven) {
  REQUIRE_SHARED_DATA();
  const auto groom = read_strands("TestHair1.tfx");
  ASSERT_TRUE(groom) << groom.error().to_string();
  EXPECT_EQ(groom->strand_count(), 10027u);
  EXPECT_EQ(groom->uniform_vertex_count(), 4u);
  EXPECT_EQ(pins_per_root(*groom), 2);
  const auto lengths = sorted_lengths(*groom);
  EXPECT_NEAR(lengths.front(), 11.0f, 1e-3f);
  EXPECT_NEAR(lengths.back(), 11.0f, 1e-3f);
}

TEST(RealGroom, PonytailPartsHaveTheirCounts) {
  REQUIRE_SHARED_DATA();
  const auto front = read_strands("ponytail_front_top.tfx");
  const auto side = read_strands("ponytail_side.tfx");
  ASSERT_TRUE(front) << front.error().to_string();
  ASSERT_TRUE(side) << side.error().to_string();
  EXPECT_EQ(front->strand_count(), 876u);
  EXPECT_EQ(side->strand_count(), 3066u);
  EXPECT_EQ(front->uniform_vertex_count(), 16u);
  EXPECT_EQ(side->uniform_vertex_count(), 16u);
  EXPECT_EQ(pins_per_root(*front), 2);
  EXPECT_EQ(pins_per_root(*side), 2);
}

TEST(RealGroom, GuessedUnitMakesHumanHeads) {
  REQUIRE_SHARED_DATA();
  struct Known {
    const char* name;
    float smallest_m, largest_m;  // bounds of a believable unit
  };
  // Sintel is in metres; the ponytail's unit is about 0.4 cm, the mohawk's skull asks for 0.63.
  for (const Known& known :
       {Known{"sintel_11400x16.tfx", 1.0f, 1.0f}, Known{"ponytail_side.tfx", 0.002f, 0.006f},
        Known{"Ratboy_mohawk.tfx", 0.5f, 0.8f}}) {
    GroomFileOptions options;
    options.path = shared_data() / "grooms" / known.name;
    const auto groom = load_groom(options);
    ASSERT_TRUE(groom) << groom.error().to_string();
    EXPECT_GE(groom->file_unit_m, known.smallest_m) << known.name;
    EXPECT_LE(groom->file_unit_m, known.largest_m) << known.name;
  }
}

TEST(RealGroom, LoadsIntoHeadSpaceAtAnyVertexCount) {
  REQUIRE_SHARED_DATA();
  GroomFileOptions options;
  options.path = shared_data() / "grooms/Ratboy_mohawk.tfx";
  options.unit_m = 2.0f;
  const auto same = load_groom(options);
  ASSERT_TRUE(same) << same.error().to_string();
  EXPECT_EQ(same->uniform_vertex_count(), 32u);
  for (const uint32_t count : {2u, 8u, 16u, 33u, 64u}) {
    options.vertex_count = count;
    const auto groom = load_groom(options);
    ASSERT_TRUE(groom) << groom.error().to_string();
    EXPECT_EQ(groom->uniform_vertex_count(), count);
    EXPECT_EQ(groom->strand_count(), 2228u);
    EXPECT_EQ(pins_per_root(*groom), 2);
    EXPECT_TRUE(validate(*groom));
  }
}

TEST(RealMesh, SintelBustAndColliderHaveTheirCounts) {
  REQUIRE_SHARED_DATA();
  const auto bust = load_obj(shared_data() / "meshes/sintel.obj", 1.0f);
  ASSERT_TRUE(bust) << bust.error().to_string();
  EXPECT_EQ(bust->position_m.size(), 3046u);
  const auto collider = load_obj(shared_data() / "meshes/sintel-collider.obj", 1.0f);
  ASSERT_TRUE(collider) << collider.error().to_string();
  EXPECT_EQ(collider->position_m.size(), 341u);
  EXPECT_EQ(collider->triangle.size(), 678u);
  for (const char* name : {"sintel-eyes.obj", "sintel-eyelashes.obj"}) {
    const auto mesh = load_obj(shared_data() / "meshes" / name, 1.0f);
    EXPECT_TRUE(mesh) << mesh.error().to_string();
  }
}

/// Watertight: every directed edge meets its opposite. Closed and outward: the enclosed volume is positive.
TEST(RealMesh, ColliderIsWatertightWithOutwardNormals) {
  REQUIRE_SHARED_DATA();
  const auto mesh = load_obj(shared_data() / "meshes/sintel-collider.obj", 1.0f);
  ASSERT_TRUE(mesh) << mesh.error().to_string();
  double volume = 0.0;
  size_t agreeing = 0;
  for (const glm::uvec3& corner : mesh->triangle) {
    const glm::dvec3 a = mesh->position_m[corner.x], b = mesh->position_m[corner.y],
                     c = mesh->position_m[corner.z];
    volume += glm::dot(a, glm::cross(b, c)) / 6.0;
    const glm::dvec3 face = glm::cross(b - a, c - a);
    agreeing += glm::dot(face, glm::dvec3(mesh->normal[corner.x])) > 0.0 ? 1 : 0;
  }
  EXPECT_GT(volume, 1e-3);  // a head holds a few litres
  EXPECT_LT(volume, 1e-2);
  EXPECT_GT(agreeing, mesh->triangle.size() * 98 / 100);
}

}  // namespace
}  // namespace strandcast::groom_real_files_test

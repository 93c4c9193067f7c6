#include "common/render/light_volume.h"

#include <cmath>
#include <glm/glm.hpp>

namespace strandcast::light_volume_test {
namespace {

constexpr float kCellM = 0.01f;
constexpr float kSideM = 0.2f;
constexpr float kStepM = 0.005f;
constexpr float kWidthM = 0.0016f;
// Mean |sine| pi / 4, and 0.3 of the light taken out by each strand.
constexpr double kPerMetre = kWidthM * (3.14159265 / 4.0) * 0.3 / (kStepM * kStepM);

// Strands along x that fill a cube of side kSideM, rows kStepM apart, one gap per centimetre.
struct Slab {
  LightVolumeDesc desc;
  std::vector<glm::vec3> position_m;
};

Slab make_slab() {
  Slab slab;
  const int rows = static_cast<int>(std::lround(kSideM / kStepM));
  const int vertices = static_cast<int>(std::lround(kSideM / kCellM)) + 1;
  slab.desc.strand_count = static_cast<uint32_t>(rows * rows);
  slab.desc.vertex_count = static_cast<uint32_t>(vertices);
  slab.desc.cell_m = kCellM;
  slab.desc.strand_width_m = kWidthM;
  for (int i = 0; i < vertices; ++i)
    for (int z = 0; z < rows; ++z)
      for (int y = 0; y < rows; ++y)
        slab.position_m.emplace_back(kCellM * static_cast<float>(i), kStepM * (static_cast<float>(y) + 0.5f),
                                     kStepM * (static_cast<float>(z) + 0.5f));
  return slab;
}

float direct_at(const LightVolume& volume, const glm::vec3& point_m) {
  const glm::ivec3 cell(glm::floor((point_m - volume.origin_m()) / volume.cell_m()));
  const glm::ivec3 size = volume.size();
  const size_t index = (static_cast<size_t>(cell.z) * size.y + cell.y) * size.x + cell.x;
  return static_cast<float>(volume.texels()[2 * index]) / 65535.0f;
}

TEST(LightVolume, SumOfCrossingsIsStrandLengthTimesWidth) {
  const Slab slab = make_slab();
  LightVolume volume(slab.desc);
  volume.build(slab.position_m, {0, 1, 0});
  double sum = 0.0;
  for (const float crossings : volume.crossings_per_m()) sum += crossings;
  const double length_m = slab.desc.strand_count * static_cast<double>(kSideM);
  const double expected = length_m * kPerMetre * kStepM * kStepM;
  EXPECT_NEAR(sum * std::pow(kCellM, 3), expected, 1e-3 * expected);
}

TEST(LightVolume, AUniformSlabAbsorbsExponentially) {
  const Slab slab = make_slab();
  LightVolume volume(slab.desc);
  volume.build(slab.position_m, {0, 1, 0});
  for (const float depth_m : {0.035f, 0.065f, 0.105f, 0.155f}) {
    const float direct = direct_at(volume, {0.5f * kSideM, kSideM - depth_m, 0.5f * kSideM});
    EXPECT_NEAR(direct, std::exp(-kPerMetre * depth_m), 0.02) << depth_m;
  }
}

TEST(LightVolume, SlantedLightGoesAProportionallyLongerWay) {
  const Slab slab = make_slab();
  LightVolume volume(slab.desc);
  const glm::vec3 to_light = glm::normalize(glm::vec3(0.0f, 1.0f, 0.6f));
  volume.build(slab.position_m, to_light);
  const float depth_m = 0.105f;
  const float direct = direct_at(volume, {0.5f * kSideM, kSideM - depth_m, 0.3f * kSideM});
  EXPECT_NEAR(direct, std::exp(-kPerMetre * depth_m / to_light.y), 0.02);
}

/// Straight hair along x whose segments are so many cells long, from end to end of the cube.
Slab make_slab_of_segments(int cells_per_segment) {
  const Slab fine = make_slab();
  Slab slab = fine;
  slab.position_m.clear();
  slab.desc.segment_m = kCellM * static_cast<float>(cells_per_segment);
  for (uint32_t i = 0; i < fine.desc.vertex_count; i += static_cast<uint32_t>(cells_per_segment)) {
    const auto row = fine.position_m.begin() + static_cast<std::ptrdiff_t>(i) * fine.desc.strand_count;
    slab.position_m.insert(slab.position_m.end(), row, row + fine.desc.strand_count);
  }
  slab.desc.vertex_count = (fine.desc.vertex_count - 1) / static_cast<uint32_t>(cells_per_segment) + 1;
  return slab;
}

// However long the segments are, hair that is the same along its length shadows the same along its length.
TEST(LightVolume, LongSegmentsLeaveNoBands) {
  for (const int cells : {1, 2, 4, 5, 10}) {
    const Slab slab = make_slab_of_segments(cells);
    ASSERT_EQ(slab.position_m.size(), size_t{slab.desc.strand_count} * slab.desc.vertex_count);
    LightVolume volume(slab.desc);
    volume.build(slab.position_m, {0, 1, 0});
    const float expected = std::exp(-static_cast<float>(kPerMetre) * 0.105f);
    for (float x_m = 0.025f; x_m < kSideM - 0.02f; x_m += kCellM)
      EXPECT_NEAR(direct_at(volume, {x_m, kSideM - 0.105f, 0.5f * kSideM}), expected, 0.02)
          << cells << " cells a segment, x = " << x_m;
  }
}

TEST(LightVolume, NoHairLetsAllLightThrough) {
  LightVolumeDesc desc;
  LightVolume volume(desc);
  volume.build({}, {0, 1, 0});
  ASSERT_FALSE(volume.texels().empty());
  for (const uint16_t texel : volume.texels()) EXPECT_EQ(texel, 65535);
}

TEST(LightVolume, TheFarSideOfTheSkullIsDark) {
  LightVolumeDesc desc;
  desc.cell_m = kCellM;
  desc.has_skull = true;
  desc.skull = {{0, 0, 0}, 0.1f};
  LightVolume volume(desc);
  volume.build({}, {0, 1, 0});
  EXPECT_GT(direct_at(volume, {0, 0.105f, 0}), 0.99f);
  EXPECT_LT(direct_at(volume, {0, -0.105f, 0}), 0.01f);
  // The same from below.
  volume.build({}, {0, -1, 0});
  EXPECT_LT(direct_at(volume, {0, 0.105f, 0}), 0.01f);
  EXPECT_GT(direct_at(volume, {0, -0.105f, 0}), 0.99f);
}

TEST(LightVolume, CellsStandStillWhileHairMoves) {
  Slab slab = make_slab();
  LightVolume volume(slab.desc);
  volume.build(slab.position_m, {0, 1, 0});
  const glm::vec3 origin_m = volume.origin_m();
  for (glm::vec3& point : slab.position_m) point += 0.37f * kCellM;
  volume.build(slab.position_m, {0, 1, 0});
  const glm::vec3 moved = (volume.origin_m() - origin_m) / kCellM;
  EXPECT_LT(glm::length(moved - glm::round(moved)), 1e-4f);
}

TEST(LightVolume, FarAwayVerticesKeepItBounded) {
  LightVolumeDesc desc;
  desc.strand_count = 2;
  desc.vertex_count = 2;
  desc.cell_m = kCellM;
  LightVolume volume(desc);
  volume.build({{0, 0, 0}, {1e20f, 0, 0}, {0, 0.01f, 0}, {-1e20f, 1e30f, 5}}, {1, 0, 0});
  for (int axis = 0; axis < 3; ++axis) EXPECT_LE(volume.size()[axis], kMaxLightCells);
}

TEST(LightVolume, CoordinatesThatAreNoNumbersAreIgnored) {
  LightVolumeDesc desc;
  desc.strand_count = 2;
  desc.vertex_count = 2;
  LightVolume volume(desc);
  volume.build({{NAN, 0, 0}, {0, INFINITY, 0}, {0, 0, NAN}, {NAN, NAN, NAN}}, {0, 1, 0});
  for (int axis = 0; axis < 3; ++axis) EXPECT_LE(volume.size()[axis], kMaxLightCells);
  for (const uint16_t texel : volume.texels()) EXPECT_EQ(texel, 65535);
}

}  // namespace
}  // namespace strandcast::light_volume_test

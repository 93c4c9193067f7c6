// How much of hair moves as one: made-up strands with known answers.
#include "common/math/coherence.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace strandcast::coherence_test {
namespace {

/// Parallel strands that hang straight down from a square of roots, and their velocities.
struct Block {
  Block(uint32_t side, double spacing_m) : strand_count(side * side) {
    for (uint32_t vertex = 0; vertex < kVertices; ++vertex)
      for (uint32_t strand = 0; strand < strand_count; ++strand)
        position_m.emplace_back(spacing_m * (strand % side), -kSegmentM * vertex,
                                spacing_m * (strand / side));
    velocity_mps.assign(position_m.size(), glm::dvec3(0.0));
  }
  Coherence measured() const {
    return measure_coherence({strand_count, kVertices, position_m, velocity_mps});
  }

  static constexpr uint32_t kVertices = 16;
  static constexpr double kSegmentM = 0.01;
  uint32_t strand_count;
  std::vector<glm::dvec3> position_m, velocity_mps;
};

/// About the middle of the block.
void spin(Block& block, const glm::dvec3& radps) {
  glm::dvec3 middle(0.0);
  for (const glm::dvec3& point : block.position_m)
    middle += point / static_cast<double>(block.position_m.size());
  for (size_t i = 0; i < block.position_m.size(); ++i)
    block.velocity_mps[i] = glm::cross(radps, block.position_m[i] - middle);
}

TEST(Coherence, LeavesOutTheFirstQuarterButNoMoreThanFourVertices) {
  EXPECT_EQ(first_measured_vertex(16), 4u);
  EXPECT_EQ(first_measured_vertex(64), 4u);
  EXPECT_EQ(first_measured_vertex(8), 2u);
  EXPECT_EQ(first_measured_vertex(2), 0u);
}

TEST(Coherence, ABlockThatIsCarriedMovesAsOne) {
  Block block(12, 0.006);
  for (glm::dvec3& velocity : block.velocity_mps) velocity = {0.3, -0.7, 0.1};
  const Coherence found = block.measured();
  EXPECT_EQ(found.incoherent_share(), 0.0);
  EXPECT_EQ(found.lone_share(), 0.0);
  EXPECT_NEAR(found.order(), 1.0, 1e-12);
  EXPECT_EQ(found.vertex_count, 12u * block.strand_count);
}

// Neighbours lie on one side of a vertex at the block's faces alone, by at most 3/8 of their reach. That is
// (5.6 mm / 0.1 m)^2 of the energy there.
TEST(Coherence, ABlockThatTurnsMovesAsOneButForItsFaces) {
  Block block(40, 0.005);
  spin(block, {0.0, 3.0, 0.0});
  EXPECT_LT(block.measured().incoherent_share(), 0.003);
  EXPECT_NEAR(block.measured().order(), 1.0, 1e-12);
}

// Of n independent velocities the mean has 1 / n of their energy: 1 + 1 / n of it is against the mean.
TEST(Coherence, RandomVelocitiesAreAllAgainstTheirNeighbours) {
  Block block(16, 0.005);
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (glm::dvec3& velocity : block.velocity_mps) velocity = {normal(random), normal(random), normal(random)};
  EXPECT_NEAR(block.measured().incoherent_share(), 1.02, 0.04);
  EXPECT_EQ(block.measured().lone_share(), 0.0);
}

TEST(Coherence, StrandsThatPointAnywhereHaveNoOrder) {
  Block block(16, 0.004);
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (uint32_t vertex = 1; vertex < Block::kVertices; ++vertex)
    for (uint32_t strand = 0; strand < block.strand_count; ++strand) {
      // Each strand goes on in a direction of its own for each segment, in a cloud as dense as the block.
      const size_t at = size_t{vertex} * block.strand_count + strand;
      const glm::dvec3 way = glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
      block.position_m[at] = block.position_m[at - block.strand_count] + 0.002 * way;
    }
  const double order = block.measured().order();
  EXPECT_LT(order, 0.35);
  EXPECT_GT(order, 0.0);
}

TEST(Coherence, StrandsFarApartAreAlone) {
  Block block(6, 2.0 * kNeighbourReachM);
  spin(block, {1.0, 2.0, 3.0});
  EXPECT_EQ(block.measured().lone_share(), 1.0);
  EXPECT_EQ(block.measured().incoherent_share(), 0.0);
  EXPECT_EQ(block.measured().order(), 0.0);
}

TEST(Coherence, IsTheSameWhereverTheHeadIsAndWhateverTheOrderOfStrands) {
  Block block(8, 0.0047);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (glm::dvec3& velocity : block.velocity_mps) velocity = {normal(random), 0.0, normal(random)};
  const double before = block.measured().incoherent_share();
  Block other = block;
  for (size_t i = 0; i < block.position_m.size(); ++i) {
    const size_t row = i / block.strand_count;
    const size_t from = row * block.strand_count + (block.strand_count - 1 - i % block.strand_count);
    other.position_m[i] = block.position_m[from] + glm::dvec3(-3.1, 1.7, 12.3);
    other.velocity_mps[i] = block.velocity_mps[from];
  }
  EXPECT_NEAR(other.measured().incoherent_share(), before, 1e-9);
}

TEST(Coherence, VerticesWithoutUsablePositionsAreAlone) {
  Block block(8, 0.005);
  block.position_m.back().x = std::nan("");
  EXPECT_EQ(block.measured().lone_count, 1u);
}

}  // namespace
}  // namespace strandcast::coherence_test

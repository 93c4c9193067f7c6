// Blocks of strands hold what was put into them, row by row, and what read_blocks() shows is what read()
// copies.
#include "common/kernels/strand_blocks.h"

#include <gtest/gtest.h>

#include "server/sim/solver_registry.h"
#include "tests/support/sim_scene.h"

namespace strandcast::strand_blocks_test {
namespace {

float value_at(uint32_t vertex, uint32_t strand, int axis) {
  return static_cast<float>(10000 * axis + 100 * static_cast<int>(vertex) + static_cast<int>(strand));
}

template <class Vector>
std::vector<Vector> numbered(uint32_t strand_count, uint32_t row_count) {
  std::vector<Vector> values;
  for (uint32_t row = 0; row < row_count; ++row)
    for (uint32_t strand = 0; strand < strand_count; ++strand) {
      Vector& value = values.emplace_back();
      for (int axis = 0; axis < Vector::length(); ++axis) value[axis] = value_at(row, strand, axis);
    }
  return values;
}

template <class Vector>
void expect_packed(uint32_t strand_count) {
  constexpr uint32_t kRows = 3;
  StrandBlocks blocks(strand_count, kRows);
  std::fill(blocks.data(), blocks.data() + blocks.size(), -1.0f);
  pack_blocks(std::span<const Vector>(numbered<Vector>(strand_count, kRows)), blocks);
  const StrandBlocksView view = blocks.view();
  for (uint32_t block = 0; block < block_count(strand_count); ++block)
    for (uint32_t row = 0; row < kRows; ++row)
      for (int axis = 0; axis < 4; ++axis)
        for (uint32_t lane = 0; lane < kBlockStrands; ++lane) {
          const uint32_t strand = std::min(block * kBlockStrands + lane, strand_count - 1);
          const float expected = axis < Vector::length() ? value_at(row, strand, axis) : 0.0f;
          EXPECT_EQ(view.row(block, row, static_cast<uint32_t>(axis))[lane], expected)
              << strand_count << " strands, block " << block << ", row " << row << ", axis " << axis
              << ", lane " << lane;
        }
}

TEST(StrandBlocks, HoldEveryValueAndTheLastStrandBeyondIt) {
  for (const uint32_t strand_count : {1u, 15u, 16u, 17u, 32u, 33u}) {
    expect_packed<glm::vec3>(strand_count);
    expect_packed<glm::vec4>(strand_count);
  }
}

TEST(StrandBlocks, RowsLieWhereVectorRegistersLoadThem) {
  const StrandBlocks blocks(33, 5);
  for (uint32_t block = 0; block < 3; ++block)
    for (uint32_t row = 0; row < 5; ++row)
      for (uint32_t axis = 0; axis < 4; ++axis)
        EXPECT_EQ(reinterpret_cast<uintptr_t>(blocks.view().row(block, row, axis)) % kBlockAlignment, 0u);
}

TEST(SolverBlocks, AreWhatReadCopies) {
  const auto row = find_solver("dftl");
  ASSERT_TRUE(row);
  const auto solver = (*row)->make_reference(complete_parameters(**row, {}).value());
  EXPECT_EQ(solver->strand_count(), 0u);
  for (const uint32_t strand_count : {5u, 21u}) {  // another groom makes other blocks
    const Groom groom = make_test_groom({.strand_count = strand_count});
    ASSERT_TRUE(solver->load(groom, {1.0, 0.0, 0.0, 0.0}));
    EXPECT_EQ(solver->strand_count(), strand_count);
    for (int step = 0; step < 3; ++step) solver->substep({});
    SolverState state;
    solver->read(state);
    const SolverBlocks blocks = solver->read_blocks();
    for (const auto& [view, values] : {std::pair(blocks.position_m, std::cref(state.position_m)),
                                       std::pair(blocks.velocity_mps, std::cref(state.velocity_mps))}) {
      ASSERT_EQ(view.strand_count, strand_count);
      ASSERT_EQ(size_t{view.row_count} * strand_count, values.get().size());
      for (uint32_t vertex = 0; vertex < view.row_count; ++vertex)
        for (uint32_t strand = 0; strand < strand_count; ++strand)
          for (uint32_t axis = 0; axis < 3; ++axis)
            EXPECT_EQ(view.row(strand / kBlockStrands, vertex, axis)[strand % kBlockStrands],
                      values.get()[size_t{vertex} * strand_count + strand][static_cast<int>(axis)]);
    }
  }
}

}  // namespace
}  // namespace strandcast::strand_blocks_test

// Lanes: whatever the instruction set, the number of threads and how strands fall into blocks, a strand gets
// the same bits; and what happens to one strand is nothing to those beside it in the register.
#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/worker_pool.h"
#include "common/kernels/strand_blocks.h"
#include "server/sim/executor/lanes_executor.h"
#include "server/sim/solver_registry.h"
#include "tests/support/sim_scene.h"

namespace strandcast::sim_lanes_test {
namespace {

constexpr double kSubstepS = 1.0 / 60.0;
constexpr int kSteps = 12;

std::vector<const SolverRow*> rows_with_kernels() {
  std::vector<const SolverRow*> rows;
  for (const SolverRow& row : solver_table())
    if (row.has_kernel) rows.push_back(&row);
  return rows;
}

StepInput violent_input(int step) {
  StepInput input = moving_input(step, kSubstepS);
  input.follicle_limit_rad = 0.4;
  return input;
}

std::unique_ptr<Solver> make_solver(const SolverRow& row, Executor& executor, const Groom& groom) {
  SceneFeatures features = all_features();
  features.has_follicle_limit = true;
  auto solver = row.make(*complete_parameters(row, {}), {&executor, features});
  EXPECT_TRUE(solver) << row.name << ": " << solver.error().to_string();
  EXPECT_TRUE((*solver)->load(groom, {1.0, 0.0, 0.0, 0.0}));
  return std::move(solver).value();
}

SolverState state_after(Solver& solver, int steps, int first = 1) {
  for (int step = first; step < first + steps; ++step) solver.substep(violent_input(step));
  SolverState state;
  solver.read(state);
  return state;
}

Groom test_groom(uint32_t strand_count, Pinning pinning = Pinning::RootPair) {
  TestGroomDesc desc;
  desc.strand_count = strand_count;
  desc.vertex_count = 12;
  desc.pinning = pinning;
  return make_test_groom(desc);
}

/// The first strands of a groom.
Groom first_strands(const Groom& groom, uint32_t count) {
  Groom first = groom;
  first.offset.resize(count + 1);
  first.rest_position_m.resize(first.offset.back());
  first.pinned.resize(first.offset.back());
  return first;
}

// Sets differ in lanes too: 4, 8 and 16.
TEST(Lanes, EverySetAndNumberOfThreadsGivesTheSameBits) {
  ASSERT_FALSE(lane_sets().empty());
  for (const Pinning pinning : {Pinning::RootPair, Pinning::BothEnds}) {
    // Enough that four threads have something to do.
    const Groom groom = test_groom(11'000, pinning);
    const Groom few = first_strands(groom, 333);
    for (const SolverRow* row : rows_with_kernels()) {
      SCOPED_TRACE(row->name);
      // All threads for the rows that are most used; every set for all.
      const bool is_main = row->name == "dftl" || row->name == "direct_rod";
      WorkerPool one(1);
      const auto widest = make_lanes_executor({lane_sets().back(), &one});
      const SolverState expected = state_after(*make_solver(*row, *widest, few), kSteps);
      for (const simd::InstructionSet set : lane_sets()) {
        const auto executor = make_lanes_executor({set, &one});
        const SolverState found = state_after(*make_solver(*row, *executor, few), kSteps);
        EXPECT_EQ(found.position_m == expected.position_m, true) << simd::to_string(set);
        EXPECT_EQ(found.velocity_mps == expected.velocity_mps, true) << simd::to_string(set);
      }
      if (!is_main) continue;
      const SolverState of_one = state_after(*make_solver(*row, *widest, groom), 3);
      for (const uint32_t threads : {2u, 4u}) {
        WorkerPool workers(threads);
        const auto executor = make_lanes_executor({lane_sets().back(), &workers});
        const SolverState found = state_after(*make_solver(*row, *executor, groom), 3);
        EXPECT_EQ(found.position_m == of_one.position_m, true) << threads << " threads";
      }
    }
  }
}

TEST(Lanes, AStrandIsTheSameInWhateverBlockItLies) {
  const Groom groom = test_groom(40);
  auto executor = make_lanes_executor();
  ASSERT_TRUE(executor);
  for (const SolverRow* row : rows_with_kernels()) {
    SCOPED_TRACE(row->name);
    const SolverState all = state_after(*make_solver(*row, **executor, groom), kSteps);
    for (const uint32_t count : {1u, 15u, 16u, 17u, 33u}) {
      const SolverState part =
          state_after(*make_solver(*row, **executor, first_strands(groom, count)), kSteps);
      ASSERT_EQ(part.position_m.size(), 12u * count);
      for (size_t i = 0; i < part.position_m.size(); ++i) {
        const size_t of_all = i / count * 40 + i % count;
        ASSERT_EQ(part.position_m[i], all.position_m[of_all]) << count << " strands, element " << i;
        ASSERT_EQ(part.velocity_mps[i], all.velocity_mps[of_all]) << count << " strands, element " << i;
      }
    }
  }
}

TEST(Lanes, ABrokenStrandIsNothingToItsNeighbours) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  constexpr uint32_t kCount = 35;
  const Groom groom = test_groom(kCount);
  auto executor = make_lanes_executor();
  ASSERT_TRUE(executor);
  for (const SolverRow* row : rows_with_kernels()) {
    SCOPED_TRACE(row->name);
    const auto whole = make_solver(*row, **executor, groom);
    const auto broken = make_solver(*row, **executor, groom);
    SolverState state = state_after(*whole, 5);
    state_after(*broken, 5);
    // In the first block, in the last one, and the whole of one between.
    state.position_m[7 * kCount + 3] = glm::vec3(nan);
    state.velocity_mps[5 * kCount + 34] = glm::vec3(std::numeric_limits<float>::infinity());
    for (uint32_t strand = 16; strand < 32; ++strand) state.position_m[3 * kCount + strand].y = -nan;
    broken->write(state);
    const SolverState expected = state_after(*whole, kSteps, 6);
    const SolverState found = state_after(*broken, kSteps, 6);
    for (size_t i = 0; i < found.position_m.size(); ++i) {
      const uint32_t strand = static_cast<uint32_t>(i % kCount);
      ASSERT_TRUE(std::isfinite(found.position_m[i].x + found.position_m[i].y + found.position_m[i].z)) << i;
      ASSERT_TRUE(std::isfinite(glm::dot(found.velocity_mps[i], found.velocity_mps[i]))) << i;
      const bool was_broken = strand == 3 || strand == 34 || (strand >= 16 && strand < 32);
      if (was_broken) continue;
      ASSERT_EQ(found.position_m[i], expected.position_m[i]) << "strand " << strand;
      ASSERT_EQ(found.velocity_mps[i], expected.velocity_mps[i]) << "strand " << strand;
    }
  }
}

TEST(Lanes, StrandsBeyondTheLastDoAsItDoes) {
  constexpr uint32_t kCount = 19;
  auto executor = make_lanes_executor();
  ASSERT_TRUE(executor);
  const auto solver = make_solver(**find_solver("direct_rod"), **executor, test_groom(kCount));
  state_after(*solver, kSteps);
  const SolverBlocks blocks = solver->read_blocks();
  for (const StrandBlocksView& view : {blocks.position_m, blocks.velocity_mps}) {
    ASSERT_EQ(view.strand_count, kCount);
    for (uint32_t vertex = 0; vertex < view.row_count; ++vertex)
      for (uint32_t axis = 0; axis < 4; ++axis) {
        const std::span row(view.row(1, vertex, axis), kBlockStrands);
        for (const float value : row.subspan(kCount - kBlockStrands)) EXPECT_EQ(value, row[2]);
      }
  }
}

TEST(Lanes, AKernelWhoseVerticesWaitForEachOtherIsRefused) {
  auto executor = make_lanes_executor();
  ASSERT_TRUE(executor);
  SolverContext context{executor->get(), all_features()};
  context.form = KernelForm::PerVertex;
  const SolverRow& row = **find_solver("dftl_parallel");
  auto solver = row.make(*complete_parameters(row, {}), context);
  const Status loaded =
      solver ? (*solver)->load(test_groom(5), {1.0, 0.0, 0.0, 0.0}) : Status(solver.error());
  ASSERT_FALSE(loaded);
  EXPECT_EQ(loaded.error().code, ErrorCode::Unsupported);
  EXPECT_THAT(loaded.error().to_string(), testing::HasSubstr("--sim-device gl"));
}

}  // namespace
}  // namespace strandcast::sim_lanes_test

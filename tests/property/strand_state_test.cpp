// Laws of the strands' state whoever steps it: a jump of the head takes it along, and a solver goes on where
// another one left it.
#include "server/sim/strand_state.h"

#include "common/gl/objects.h"
#include "tests/support/solver_fixture.h"

namespace strandcast::strand_state_test {
namespace {

constexpr double kSubstepS = 1.0 / 60.0;
// A position of 0.35 m and a velocity of 4 m/s, stored in float before and after.
constexpr double kPositionRoundingM = 2.0 * 3e-8;
constexpr double kVelocityRoundingMps = 2.0 * 5e-7;

const glm::dquat kTurn = glm::angleAxis(2.1, glm::normalize(glm::dvec3(0.3, -1.0, 0.5)));

class StrandStates : public SolverTest {};

std::vector<glm::vec3> turned(std::vector<glm::vec3> values, const glm::dquat& turn) {
  for (glm::vec3& value : values) value = glm::vec3(turn * glm::dvec3(value));
  return values;
}

TEST_F(StrandStates, AJumpOfTheHeadChangesNothingSeenFromTheHead) {
  const Groom groom = make_test_groom({});
  for (const SolverKind& kind : all_kinds()) {
    SCOPED_TRACE(kind.name());
    auto solver = make(kind, groom, {}, moving_input(0, kSubstepS).world_from_head_rotation);
    for (int step = 1; step <= 6; ++step) solver->substep(moving_input(step, kSubstepS));
    const glm::dquat before = moving_input(6, kSubstepS).world_from_head_rotation;
    const SolverState old = read(*solver);
    solver->rebase(kTurn * before);
    const SolverState now = read(*solver);
    EXPECT_LE(largest_distance_m(turned(now.position_m, glm::conjugate(kTurn)), old.position_m),
              kPositionRoundingM);
    EXPECT_LE(largest_distance_m(turned(now.velocity_mps, glm::conjugate(kTurn)), old.velocity_mps),
              kVelocityRoundingMps);
    EXPECT_GT(largest_distance_m(now.position_m, old.position_m), 0.1) << "the world sees the jump";
  }
}

// What a model keeps beside the state (tensions, frames, spins, a second strand, how the head turned) must
// jump along, else it would pull the strands about as if they had not.
TEST_F(StrandStates, AfterAJumpIntoAWorldTurnedAlikeTheMotionGoesOn) {
  const Groom groom = make_test_groom({});
  for (const SolverKind& kind : all_kinds()) {
    SCOPED_TRACE(kind.name());
    const glm::dquat start = moving_input(0, kSubstepS).world_from_head_rotation;
    const SolverParameters given = {{"random_order", 1.0}};
    auto staying = make(kind, groom, given, start);
    auto jumping = make(kind, groom, given, start);
    for (int step = 1; step <= 8; ++step) {
      staying->substep(moving_input(step, kSubstepS));
      jumping->substep(moving_input(step, kSubstepS));
    }
    jumping->rebase(kTurn * moving_input(8, kSubstepS).world_from_head_rotation);
    for (int step = 9; step <= 12; ++step) {
      staying->substep(moving_input(step, kSubstepS));
      jumping->substep(turned(moving_input(step, kSubstepS), kTurn));
    }
    const std::vector<glm::vec3> expected = turned(read(*staying).position_m, kTurn);
    // As for a world that is turned from the start (solver_laws_test.cpp), over fewer steps.
    EXPECT_LE(largest_distance_m(read(*jumping).position_m, expected), 1e-4);
  }
}

TEST_F(StrandStates, StrandsAsLoadedJumpBeforeTheirFirstStep) {
  const Groom groom = make_test_groom({});
  StepInput standing;
  standing.world_from_head_rotation = kTurn;
  standing.gravity_mps2 = kTurn * standing.gravity_mps2;
  standing.groom_gravity_in_head_mps2 = {0.0, -9.81, 0.0};
  for (const SolverKind& kind : all_kinds()) {
    SCOPED_TRACE(kind.name());
    auto loaded = make(kind, groom, {}, kTurn);
    auto jumped = make(kind, groom);
    jumped->rebase(kTurn);
    for (int step = 1; step <= 10; ++step) {
      loaded->substep(standing);
      jumped->substep(standing);
    }
    EXPECT_LE(largest_distance_m(read(*jumped).position_m, read(*loaded).position_m), 1e-5);
  }
}

/// Of one executor.
class StrandsOf : public SolverTest, public testing::WithParamInterface<SimDevice> {
 protected:
  /// A solver of the row's defaults on the given strands, not yet loaded.
  std::unique_ptr<Solver> make_on(const SolverRow& row, std::shared_ptr<StrandState> strands) {
    const auto parameters = complete_parameters(row, {});
    auto made = row.make(*parameters, {&executor_, all_features(), KernelForm::Auto, std::move(strands)});
    EXPECT_TRUE(made) << made.error().to_string();
    return std::move(made).value();
  }

  Executor& executor_ = executors_.on(GetParam());
};

TEST_P(StrandsOf, ASolverGoesOnWhereAnotherLeftTheStrands) {
  const Groom groom = make_test_groom({});
  const glm::dquat start = moving_input(0, kSubstepS).world_from_head_rotation;
  const std::vector<SolverRow>& table = solver_table();
  for (size_t i = 0; i < table.size(); ++i) {
    const SolverRow& before = table[i];
    const SolverRow& after = table[(i + 1) % table.size()];
    if (!before.has_kernel || !after.has_kernel) continue;
    SCOPED_TRACE(before.name + " to " + after.name);
    const auto strands = std::make_shared<StrandState>(executor_);
    auto first = make_on(before, strands);
    ASSERT_TRUE(first->load(groom, start));
    StepInput input;
    for (int step = 1; step <= 8; ++step) {
      input = moving_input(step, kSubstepS);
      first->substep(input);
    }
    // The head comes to a stop: a solver that is loaded anew knows of no turn.
    input.head_shift_m = glm::dvec3(0.0);
    first->substep(input);
    const SolverState left = read(*first);

    auto second = make_on(after, strands);
    ASSERT_TRUE(hand_over(*first, *second, groom, input.world_from_head_rotation));
    first.reset();
    EXPECT_EQ(second->strands(), strands.get());
    EXPECT_EQ(read(*second).position_m, left.position_m);
    EXPECT_EQ(read(*second).velocity_mps, left.velocity_mps);

    // As a solver with strands of its own that is given a copy.
    auto copied = make_on(after, nullptr);
    ASSERT_TRUE(copied->load(groom, input.world_from_head_rotation));
    copied->write(left);
    for (int step = 9; step <= 12; ++step) {
      second->substep(moving_input(step, kSubstepS));
      copied->substep(moving_input(step, kSubstepS));
    }
    EXPECT_EQ(read(*second).position_m, read(*copied).position_m);
    EXPECT_EQ(read(*second).velocity_mps, read(*copied).velocity_mps);
  }
}

TEST_P(StrandsOf, SolversWithAndWithoutStrandsOnAnExecutorFollowEachOther) {
  const Groom groom = make_test_groom({});
  const auto strands = std::make_shared<StrandState>(executor_);
  const SolverRow& kernel = **find_solver("dftl");
  const SolverRow& helix = **find_solver("super_helix");
  auto on_planes = make_on(kernel, strands);
  ASSERT_TRUE(on_planes->load(groom, glm::dquat(1.0, 0.0, 0.0, 0.0)));
  for (int step = 1; step <= 4; ++step) on_planes->substep(moving_input(step, kSubstepS));
  const glm::dquat rotation = moving_input(4, kSubstepS).world_from_head_rotation;
  auto own = make_on(helix, strands);
  ASSERT_TRUE(hand_over(*on_planes, *own, groom, rotation));
  EXPECT_EQ(own->strands(), nullptr);
  EXPECT_EQ(read(*own).position_m, read(*on_planes).position_m);
  own->substep(moving_input(5, kSubstepS));
  auto back = make_on(kernel, strands);
  ASSERT_TRUE(hand_over(*own, *back, groom, moving_input(5, kSubstepS).world_from_head_rotation));
  EXPECT_EQ(read(*back).position_m, read(*own).position_m);
  EXPECT_EQ(read(*back).velocity_mps, read(*own).velocity_mps);
}

TEST_P(StrandsOf, ConstantsThatNoKernelDeclaresAreErrors) {
  const auto error_of = [this](const ModelConstants& constants) {
    KernelDesc desc;
    desc.shader_path = "sim/dftl_odd_even.comp";
    desc.constants = constants;
    StrandLayout layout;
    layout.strand_count = 1;
    layout.vertex_count = 3;
    const auto program = executor_.make_program(desc, {}, layout);
    return program ? "" : program.error().to_string();
  };
  EXPECT_EQ(error_of({{"u_iterations", 4u}}), "");
  EXPECT_THAT(error_of({{"u_iteration", 4u}}), testing::HasSubstr("u_iteration"));
  EXPECT_THAT(error_of({{"u_iterations", 4.0}}), testing::HasSubstr("u_iterations is declared as uint"));
}

TEST_P(StrandsOf, WhatIsReadInBlocksIsWhatIsRead) {
  for (const char* name : {"dftl", "direct_rod"}) {
    auto solver = make_on(**find_solver(name), nullptr);
    const Groom groom = make_test_groom({});  // the last block is not full
    ASSERT_TRUE(solver->load(groom, glm::dquat(1.0, 0.0, 0.0, 0.0)));
    for (int step = 1; step <= 4; ++step) solver->substep(moving_input(step, kSubstepS));
    const SolverState state = read(*solver);
    const SolverBlocks blocks = solver->read_blocks();
    const uint32_t strand_count = groom.strand_count();
    ASSERT_EQ(solver->strand_count(), strand_count);
    for (const auto& [view, values] : {std::pair(blocks.position_m, std::cref(state.position_m)),
                                       std::pair(blocks.velocity_mps, std::cref(state.velocity_mps))}) {
      ASSERT_EQ(view.strand_count, strand_count);
      ASSERT_EQ(view.row_count, groom.uniform_vertex_count());
      for (uint32_t i = 0; i < view.row_count * block_count(strand_count) * kBlockStrands; ++i) {
        const uint32_t vertex = i / (block_count(strand_count) * kBlockStrands);
        const uint32_t place = i % (block_count(strand_count) * kBlockStrands);
        const uint32_t strand = std::min(place, strand_count - 1);
        for (int axis = 0; axis < 3; ++axis)
          EXPECT_EQ(
              view.row(place / kBlockStrands, vertex, static_cast<uint32_t>(axis))[place % kBlockStrands],
              values.get()[size_t{vertex} * strand_count + strand][axis])
              << name << ", vertex " << vertex << ", strand " << place;
      }
    }
  }
}

// A reset or another groom compiles nothing anew; other constants do.
TEST_P(StrandsOf, WhatIsCompiledIsNotCompiledAgain) {
  const auto compiled = [] { return gl::object_counts().compiled_programs; };
  auto solver = make_on(**find_solver("dftl"), nullptr);
  ASSERT_TRUE(solver->load(make_test_groom({}), glm::dquat(1.0, 0.0, 0.0, 0.0)));
  const uint64_t before = compiled();
  ASSERT_TRUE(solver->load(make_test_groom({}), glm::dquat(1.0, 0.0, 0.0, 0.0)));
  ASSERT_TRUE(
      solver->load(make_test_groom({.strand_count = 70, .vertex_count = 9}), glm::dquat(1.0, 0.0, 0.0, 0.0)));
  auto second = make_on(**find_solver("dftl"), nullptr);
  ASSERT_TRUE(second->load(make_test_groom({}), glm::dquat(1.0, 0.0, 0.0, 0.0)));
  EXPECT_EQ(compiled(), before);
}

INSTANTIATE_TEST_SUITE_P(EveryExecutor, StrandsOf, testing::ValuesIn(sim_devices()), name_of_device);

}  // namespace
}  // namespace strandcast::strand_state_test

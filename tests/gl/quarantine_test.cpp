// A strand that loses its numbers in a kernel comes back, and its neighbours never notice: for every solver.

#include <cmath>
#include <limits>

#include "server/publish/publisher.h"
#include "server/sim/solver_registry.h"
#include "tests/support/sim_devices.h"
#include "tests/support/sim_scene.h"

namespace strandcast::quarantine_test {
namespace {

using testing::ElementsAreArray;

constexpr double kStepS = 1.0 / 60.0;
constexpr float kBoundM = 1e-4f;
constexpr uint32_t kPoisoned = 9;

class Quarantine : public testing::TestWithParam<SimDevice> {
 protected:
  Quarantine() : groom_(make_test_groom({})) {}

  std::unique_ptr<Solver> make(const SolverRow& row) {
    auto solver = row.make(complete_parameters(row, {}).value(), {&executor_, all_features()});
    EXPECT_TRUE(solver) << solver.error().to_string();
    if (!solver) return nullptr;
    EXPECT_TRUE((*solver)->load(groom_, glm::dquat(1.0, 0.0, 0.0, 0.0)));
    return std::move(solver).value();
  }
  /// Steps, lets `strike` spoil the solver's state, and publishes; what is broken then is repaired.
  template <class Strike>
  std::shared_ptr<const Snapshot> step(Solver& solver, Publisher& publisher, int k, Strike strike) {
    const StepInput input = moving_input(k, kStepS);
    solver.substep(input);
    strike(solver);
    PublishInput publish_input;
    publish_input.tick = static_cast<uint64_t>(k);
    publish_input.sim_time_ns = std::llround(k * kStepS * 1e9);
    publish_input.world_from_head.rotation = input.world_from_head_rotation;
    auto snapshot = publisher.publish(solver, publish_input);
    if (!publisher.quarantined().empty()) publisher.repair(solver);
    return snapshot;
  }
  /// One vertex in the middle of one strand.
  void poison(Solver& solver, float value) const {
    SolverState state;
    solver.read(state);
    state.velocity_mps[8 * groom_.strand_count() + kPoisoned] = glm::vec3(value);
    state.position_m[9 * groom_.strand_count() + kPoisoned] = glm::vec3(value);
    solver.write(state);
  }

  /// The outer half of one strand, relative to where its rest shape would be.
  void pull_apart(Solver& solver, float away_m) const {
    SolverState state;
    solver.read(state);
    for (uint32_t vertex = 8; vertex < groom_.uniform_vertex_count(); ++vertex) {
      glm::vec3& point = state.position_m[vertex * groom_.strand_count() + kPoisoned];
      const glm::vec3 inner = state.position_m[7 * groom_.strand_count() + kPoisoned];
      point = inner + glm::vec3(0.0f, away_m + 0.01f * static_cast<float>(vertex), 0.0f);
    }
    solver.write(state);
  }

  void expect_equal_but_poisoned(const Snapshot& a, const Snapshot& b, const std::string& solver) const {
    ASSERT_EQ(a.lattice.size(), b.lattice.size());
    for (size_t i = 0; i < a.lattice.size(); ++i) {
      if (i % groom_.strand_count() == kPoisoned) continue;
      ASSERT_EQ(a.lattice[i], b.lattice[i]) << solver << ", tick " << a.tick;
    }
  }

  void expect_poisoned_at_rest(Solver& solver, const glm::dquat& world_from_head_rotation,
                               const std::string& name) const {
    SolverState state;
    solver.read(state);
    for (uint32_t vertex = 0; vertex < groom_.uniform_vertex_count(); ++vertex) {
      const size_t i = static_cast<size_t>(vertex) * groom_.strand_count() + kPoisoned;
      const glm::dvec3 rest(groom_.rest_position_m[groom_.offset[kPoisoned] + vertex]);
      EXPECT_LT(glm::distance(glm::dvec3(state.position_m[i]), world_from_head_rotation * rest), 1e-6)
          << name;
      EXPECT_EQ(state.velocity_mps[i], glm::vec3(0.0f)) << name;
    }
  }

  SimExecutors executors_;
  Executor& executor_ = executors_.on(GetParam());
  Groom groom_;
};

TEST_P(Quarantine, APoisonedStrandReturnsAndItsNeighboursKeepTheirBits) {
  for (const SolverRow& row : solver_table()) {
    for (const float value :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
      const auto clean_solver = make(row);
      const auto solver = make(row);
      ASSERT_TRUE(clean_solver && solver) << row.name;
      Publisher clean_publisher(groom_, kBoundM);
      Publisher publisher(groom_, kBoundM);
      for (int k = 1; k <= 30; ++k) {
        const bool is_struck = k == 10;
        const auto clean = step(*clean_solver, clean_publisher, k, [](Solver&) {});
        const auto snapshot = step(*solver, publisher, k, [&](Solver& target) {
          if (is_struck) poison(target, value);
        });
        const std::vector<uint32_t> expected =
            is_struck ? std::vector<uint32_t>{kPoisoned} : std::vector<uint32_t>{};
        ASSERT_THAT(publisher.quarantined(), ElementsAreArray(expected)) << row.name << ", step " << k;
        expect_equal_but_poisoned(*snapshot, *clean, row.name);
        if (is_struck)
          expect_poisoned_at_rest(*solver, moving_input(k, kStepS).world_from_head_rotation, row.name);
      }
      EXPECT_EQ(clean_publisher.quarantine_count(), 0u);
    }
  }
}

/// One strand's outer half is pulled away after every step, until the publisher has had enough of it.
TEST_P(Quarantine, AnOverStretchedStrandReturnsAndItsNeighboursKeepTheirBits) {
  constexpr float kAwayM = 0.25f;  // a segment has at most 0.017 m
  for (const SolverRow& row : solver_table()) {
    const auto clean_solver = make(row);
    const auto solver = make(row);
    ASSERT_TRUE(clean_solver && solver) << row.name;
    Publisher clean_publisher(groom_, kBoundM);
    Publisher publisher(groom_, kBoundM);
    for (Publisher* each : {&clean_publisher, &publisher}) each->watch_stretch(row.stretch_bound);
    for (int k = 1; k <= 40; ++k) {
      const auto clean = step(*clean_solver, clean_publisher, k, [](Solver&) {});
      const auto snapshot = step(*solver, publisher, k, [&](Solver& target) {
        if (k < 10 || publisher.overstretch_count() > 0) return;
        pull_apart(target, kAwayM);
      });
      expect_equal_but_poisoned(*snapshot, *clean, row.name);
    }
    EXPECT_EQ(publisher.overstretch_count(), 1u) << row.name;
    EXPECT_EQ(publisher.quarantine_count(), 0u) << row.name;
    EXPECT_EQ(clean_publisher.overstretch_count(), 0u) << row.name;
  }
}

/// A solver may heal a strand by itself; then it has a usable shape, and otherwise it is quarantined for one
/// step.
TEST_P(Quarantine, PoisonThatGoesThroughAStepIsGoneAfterIt) {
  constexpr float kReachM = 1.0f;  // head radius and strand length are well below
  for (const SolverRow& row : solver_table()) {
    for (const float value :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
      const auto clean_solver = make(row);
      const auto solver = make(row);
      ASSERT_TRUE(clean_solver && solver) << row.name;
      Publisher clean_publisher(groom_, kBoundM);
      Publisher publisher(groom_, kBoundM);
      for (int k = 1; k <= 30; ++k) {
        if (k == 10) poison(*solver, value);
        const auto clean = step(*clean_solver, clean_publisher, k, [](Solver&) {});
        const auto snapshot = step(*solver, publisher, k, [](Solver&) {});
        for (const glm::vec3& point : positions_in_head(*snapshot))
          ASSERT_LT(glm::length(point), kReachM) << row.name;
        ASSERT_TRUE(publisher.quarantined().empty() || k == 10) << row.name << ", step " << k;
        expect_equal_but_poisoned(*snapshot, *clean, row.name);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(EveryExecutor, Quarantine, testing::ValuesIn(sim_devices()), name_of_device);

}  // namespace
}  // namespace strandcast::quarantine_test

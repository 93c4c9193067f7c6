// Publishing from blocks gives what plain loops give, bit for bit: for any strands, broken and stretched ones
// among them, on every instruction set and any number of threads.
#include <gmock/gmock.h>

#include <limits>
#include <random>
#include <set>

#include "tests/support/own_workers.h"
#include "tests/support/plain_publisher.h"

namespace strandcast::publish_blocks_test {
namespace {

using testing::ElementsAreArray;
using testing::IsEmpty;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

class HeldSolver final : public Solver {
 public:
  explicit HeldSolver(uint32_t strand_count) : strand_count_(strand_count) {}
  Status load(const Groom&, const glm::dquat&) override { return {}; }
  void substep(const StepInput&) override {}
  void read(SolverState& out) override { out = state; }
  void write(const SolverState& in) override { state = in; }
  void rebase(const glm::dquat&) override {}
  uint32_t strand_count() const override { return strand_count_; }
  uint64_t memory_bytes() const override { return 0; }

  SolverState state;

 private:
  uint32_t strand_count_;
};

/// Strands of random steps.
Groom random_groom(uint32_t strand_count, uint32_t vertex_count, std::mt19937& random) {
  std::uniform_real_distribution<float> step(-0.03f, 0.03f);
  Groom groom;
  groom.offset = {0};
  for (uint32_t strand = 0; strand < strand_count; ++strand) {
    glm::vec3 point(10.0f * step(random), 0.1f, 10.0f * step(random));
    for (uint32_t vertex = 0; vertex < vertex_count; ++vertex) {
      groom.rest_position_m.push_back(point);
      point += glm::vec3(step(random), step(random), step(random));
    }
    groom.offset.push_back(static_cast<uint32_t>(groom.rest_position_m.size()));
  }
  groom.pinned.assign(groom.rest_position_m.size(), 0);
  return groom;
}

/// Strands as in the groom, turned, shaken by up to twice a segment, and every so often something impossible.
SolverState shaken(const Groom& groom, const glm::dquat& turn, std::mt19937& random) {
  const uint32_t strand_count = groom.strand_count();
  std::uniform_real_distribution<float> shake(-0.04f, 0.04f);
  std::uniform_real_distribution<float> speed(-3.0f, 3.0f);
  std::uniform_int_distribution<int> dice(0, 400);
  SolverState state;
  for (uint32_t vertex = 0; vertex < groom.uniform_vertex_count(); ++vertex)
    for (uint32_t strand = 0; strand < strand_count; ++strand) {
      const glm::vec3 rest = groom.rest_position_m[groom.offset[strand] + vertex];
      state.position_m.push_back(glm::vec3(turn * glm::dvec3(rest)) +
                                 glm::vec3(shake(random), shake(random), shake(random)));
      state.velocity_mps.emplace_back(speed(random), speed(random), speed(random));
      switch (dice(random)) {
        case 0:
          state.position_m.back().y = kNan;
          break;
        case 1:
          state.velocity_mps.back().z = -kInfinity;
          break;
        case 2:
          state.velocity_mps.back().x = kNan;
          break;
        case 3:
          state.position_m.back().x = -1.01f * kMaxStrandReachM;
          break;
        case 4:
          state.position_m.back().z = kMaxStrandReachM;
          break;  // may be, but has run away
        case 5:
          state.position_m.back() = glm::vec3(0.0f);
          break;
        case 6:
          state.position_m.back().y = kInfinity;
          break;
        default:
          break;
      }
    }
  return state;
}

struct Shape {
  uint32_t strand_count;
  uint32_t vertex_count;
};
constexpr Shape kShapes[] = {{1, 2}, {7, 5}, {8, 3}, {15, 4}, {16, 16}, {17, 2}, {31, 8}, {300, 16}};

TEST(PublishedBlocks, AreWhatPlainLoopsPublishOnEveryInstructionSet) {
  constexpr double kStretchBound = 0.2;
  for (const Shape& shape : kShapes) {
    // The lattices of the codecs, and one on which most of the hair lies beyond the last value.
    for (const float quantum_m : {1.1e-4f, 3.9e-7f, 1e-10f}) {
      std::mt19937 random(shape.strand_count);
      const Groom groom = random_groom(shape.strand_count, shape.vertex_count, random);
      HeldSolver solver(shape.strand_count);
      PlainPublisher plain(groom, quantum_m);
      plain.watch_stretch(kStretchBound);
      std::vector<Publisher> publishers;
      for (const simd::InstructionSet set : simd::instruction_sets())
        publishers.emplace_back(groom, quantum_m, PublishMeans{own_workers(2), set});
      for (Publisher& publisher : publishers) publisher.watch_stretch(kStretchBound);
      uint64_t bad_vertices = 0, broken = 0;
      for (int step = 0; step < 40; ++step) {
        PublishInput input;
        input.tick = static_cast<uint64_t>(step);
        input.sim_time_ns = step * 16'666'667LL;
        input.world_from_head.rotation =
            glm::angleAxis(0.3 * step, glm::normalize(glm::dvec3(1.0, -2.0, 0.1 * step)));
        solver.state = shaken(groom, input.world_from_head.rotation, random);
        const PlainPublished expected = plain.publish(solver.state, input);
        bad_vertices += expected.bad_vertices;
        broken += expected.broken;
        for (Publisher& publisher : publishers) {
          const auto snapshot = publisher.publish(solver, input);
          ASSERT_THAT(publisher.quarantined(), ElementsAreArray(expected.quarantined)) << step;
          ASSERT_TRUE(snapshot->lattice == expected.snapshot.lattice)
              << shape.strand_count << " x " << shape.vertex_count << ", step " << step;
          ASSERT_EQ(state_hash(*snapshot), state_hash(expected.snapshot));
          ASSERT_EQ(publisher.bad_vertex_count(), bad_vertices);
          ASSERT_EQ(publisher.quarantine_count(), broken);
        }
      }
      EXPECT_GT(shape.strand_count < 10 ? 1 : broken, 0u) << "no strand was ever broken";
    }
  }
}

// Halfway between two lattice values the even one is taken, as std::lrint does.
TEST(PublishedBlocks, HalvesGoToTheEvenValue) {
  constexpr float kQuantumM = 0x1p-12f;
  std::mt19937 random(1);
  const Groom groom = random_groom(16, 2, random);
  HeldSolver solver(16);
  solver.state.velocity_mps.resize(32);
  for (int i = 0; i < 32; ++i)
    solver.state.position_m.emplace_back((static_cast<float>(i) - 15.5f) * kQuantumM, 0.0f, 0.0f);
  for (const simd::InstructionSet set : simd::instruction_sets()) {
    Publisher publisher(groom, kQuantumM, {own_workers(1), set});
    const auto snapshot = publisher.publish(solver, {});
    for (int i = 0; i < 32; ++i)
      EXPECT_EQ(snapshot->lattice[static_cast<size_t>(i)], std::lrint(i - 15.5)) << i;
  }
}

TEST(PublishedBlocks, AreTheSameForAnyNumberOfThreads) {
  constexpr Shape kMany{5000, 32};  // several ranges
  std::mt19937 random(9);
  const Groom groom = random_groom(kMany.strand_count, kMany.vertex_count, random);
  HeldSolver solver(kMany.strand_count);
  solver.state = shaken(groom, glm::angleAxis(1.0, glm::dvec3(0.0, 1.0, 0.0)), random);
  Publisher alone(groom, 1e-6f, {own_workers(1)});
  const auto expected = alone.publish(solver, {});
  EXPECT_FALSE(alone.quarantined().empty());
  for (const uint32_t threads : {2u, 4u}) {
    Publisher publisher(groom, 1e-6f, {own_workers(threads)});
    EXPECT_TRUE(publisher.publish(solver, {})->lattice == expected->lattice) << threads;
    EXPECT_THAT(publisher.quarantined(), ElementsAreArray(alone.quarantined())) << threads;
  }
}

TEST(PublishedSnapshots, NeverChangeWhileAnybodyHasThem) {
  std::mt19937 random(5);
  const Groom groom = random_groom(20, 4, random);
  auto publisher = std::make_unique<Publisher>(groom, 1e-4f);
  HeldSolver solver(20);
  const auto publish = [&] {
    solver.state = shaken(groom, glm::dquat(1.0, 0.0, 0.0, 0.0), random);
    return publisher->publish(solver, {});
  };
  std::vector<std::shared_ptr<const Snapshot>> kept;
  std::vector<uint64_t> hashes;
  for (int i = 0; i < 10; ++i) {
    kept.push_back(publish());
    hashes.push_back(state_hash(*kept.back()));
    publish();  // somebody's who has looked at it already
  }
  std::set<const int32_t*> places;
  for (size_t i = 0; i < kept.size(); ++i) {
    EXPECT_EQ(state_hash(*kept[i]), hashes[i]) << i;
    places.insert(kept[i]->lattice.data());
  }
  EXPECT_EQ(places.size(), kept.size());
  kept.resize(1);
  publisher.reset();
  EXPECT_EQ(state_hash(*kept[0]), hashes[0]) << "snapshots outlive their publisher";
}

}  // namespace
}  // namespace strandcast::publish_blocks_test

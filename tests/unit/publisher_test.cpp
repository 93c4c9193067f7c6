#include "server/publish/publisher.h"

#include <cmath>
#include <limits>
#include <random>

#include "server/publish/snapshot_slot.h"
#include "tests/support/eventually.h"

namespace strandcast::publisher_test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr uint32_t kStrands = 5;
constexpr uint32_t kVertices = 4;
constexpr float kBoundM = 1e-4f;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Holds a state and counts what is done with it.
class FakeSolver : public Solver {
 public:
  Status load(const Groom&, const glm::dquat&) override { return {}; }
  void substep(const StepInput&) override {}
  void read(SolverState& out) override {
    out.position_m.resize(state.position_m.size());
    out.velocity_mps.resize(state.velocity_mps.size());
    std::copy(state.position_m.begin(), state.position_m.end(), out.position_m.begin());
    std::copy(state.velocity_mps.begin(), state.velocity_mps.end(), out.velocity_mps.begin());
    read_target = out.position_m.data();
  }
  void write(const SolverState& in) override { state = in; }
  void rebase(const glm::dquat&) override {}
  uint32_t strand_count() const override { return kStrands; }
  uint64_t memory_bytes() const override { return 0; }

  SolverState state;
  const void* read_target = nullptr;
};

Groom straight_groom() {
  Groom groom;
  groom.offset = {0};
  for (uint32_t strand = 0; strand < kStrands; ++strand) {
    for (uint32_t vertex = 0; vertex < kVertices; ++vertex)
      groom.rest_position_m.emplace_back(0.01f * static_cast<float>(strand), 0.1f,
                                         0.05f * static_cast<float>(vertex));
    groom.offset.push_back(static_cast<uint32_t>(groom.rest_position_m.size()));
  }
  groom.pinned.assign(groom.rest_position_m.size(), 0);
  return groom;
}

size_t index(uint32_t strand, uint32_t vertex) {
  return static_cast<size_t>(vertex) * kStrands + strand;
}

glm::vec3 rest_of(const Groom& groom, uint32_t strand, uint32_t vertex) {
  return groom.rest_position_m[groom.offset[strand] + vertex];
}

glm::dquat some_rotation() {
  return glm::angleAxis(1.3, glm::normalize(glm::dvec3(1.0, -2.0, 0.5)));
}

class Publishing : public testing::Test {
 protected:
  Publishing() : groom_(straight_groom()), publisher_(groom_, kBoundM) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> place(-1.0f, 1.0f);
    for (uint32_t i = 0; i < kStrands * kVertices; ++i) {
      solver_.state.position_m.emplace_back(place(random), place(random), place(random));
      solver_.state.velocity_mps.emplace_back(place(random), place(random), place(random));
    }
    input_.tick = 7;
    input_.sim_time_ns = 123;
    input_.motion_time_ns = 99;
    input_.world_from_head.position_m = {100.0, 2.0, -50.0};
    input_.world_from_head.rotation = some_rotation();
  }

  Groom groom_;
  Publisher publisher_;
  FakeSolver solver_;
  PublishInput input_;
};

TEST_F(Publishing, RotatingBackGivesTheSolversPositionsWithinTheBound) {
  const auto snapshot = publisher_.publish(solver_, input_);
  EXPECT_EQ(snapshot->tick, 7u);
  EXPECT_EQ(snapshot->sim_time_ns, 123);
  EXPECT_EQ(snapshot->motion_time_ns, 99);
  EXPECT_EQ(snapshot->world_from_head, input_.world_from_head);
  const auto in_head = positions_in_head(*snapshot);
  ASSERT_EQ(in_head.size(), solver_.state.position_m.size());
  for (size_t i = 0; i < in_head.size(); ++i) {
    const glm::dvec3 head_relative = input_.world_from_head.rotation * glm::dvec3(in_head[i]);
    EXPECT_LE(glm::length(head_relative - glm::dvec3(solver_.state.position_m[i])), kBoundM);
  }
}

TEST_F(Publishing, HairThatMovesRigidlyWithTheHeadStaysTheSameInHeadSpace) {
  const auto first = publisher_.publish(solver_, input_);
  const glm::dquat turn = glm::angleAxis(0.7, glm::normalize(glm::dvec3(0.2, 1.0, 0.1)));
  for (glm::vec3& position : solver_.state.position_m) position = glm::vec3(turn * glm::dvec3(position));
  input_.world_from_head.rotation = turn * input_.world_from_head.rotation;
  const auto second = publisher_.publish(solver_, input_);
  // Only the float rounding of the rotated state differs: far less than a lattice step, so at most one step.
  for (size_t i = 0; i < first->lattice.size(); ++i)
    EXPECT_LE(std::abs(first->lattice[i] - second->lattice[i]), 1);
}

TEST_F(Publishing, BrokenStrandsAreShownAtRestAndTheOthersAsTheyAre) {
  const auto clean = publisher_.publish(solver_, input_);
  EXPECT_THAT(publisher_.quarantined(), IsEmpty());
  solver_.state.position_m[index(1, 2)].y = kNan;
  solver_.state.position_m[index(1, 3)].x = kInfinity;
  solver_.state.velocity_mps[index(3, 0)].z = -kInfinity;
  solver_.state.position_m[index(4, 1)].x = 2.0f * kMaxStrandReachM;
  const auto snapshot = publisher_.publish(solver_, input_);
  EXPECT_THAT(publisher_.quarantined(), ElementsAre(1u, 3u, 4u));
  EXPECT_EQ(publisher_.bad_vertex_count(), 4u);
  EXPECT_EQ(publisher_.quarantine_count(), 3u);
  const auto in_head = positions_in_head(*snapshot);
  const auto clean_in_head = positions_in_head(*clean);
  for (uint32_t strand = 0; strand < kStrands; ++strand) {
    for (uint32_t vertex = 0; vertex < kVertices; ++vertex) {
      const size_t i = index(strand, vertex);
      if (strand == 0 || strand == 2)
        EXPECT_EQ(in_head[i], clean_in_head[i]);
      else
        EXPECT_LE(glm::length(in_head[i] - rest_of(groom_, strand, vertex)), kBoundM) << strand;
    }
  }
}

TEST_F(Publishing, RepairPutsBrokenStrandsToRestAndLeavesTheOthers) {
  const SolverState clean = solver_.state;
  solver_.state.velocity_mps[index(2, 1)].x = kNan;
  publisher_.publish(solver_, input_);
  publisher_.repair(solver_);
  for (uint32_t strand = 0; strand < kStrands; ++strand) {
    for (uint32_t vertex = 0; vertex < kVertices; ++vertex) {
      const size_t i = index(strand, vertex);
      if (strand != 2) {
        EXPECT_EQ(solver_.state.position_m[i], clean.position_m[i]);
        EXPECT_EQ(solver_.state.velocity_mps[i], clean.velocity_mps[i]);
        continue;
      }
      const glm::vec3 rest(some_rotation() * glm::dvec3(rest_of(groom_, strand, vertex)));
      EXPECT_LE(glm::length(solver_.state.position_m[i] - rest), 1e-6f);
      EXPECT_EQ(solver_.state.velocity_mps[i], glm::vec3(0.0f));
    }
  }
  publisher_.publish(solver_, input_);
  EXPECT_THAT(publisher_.quarantined(), IsEmpty()) << "one repair is enough";
}

/// Strands at rest under some_rotation(), of which single segments are pulled longer.
class OverStretch : public Publishing {
 protected:
  OverStretch() {
    for (uint32_t strand = 0; strand < kStrands; ++strand) stretch(strand, 0, 0.0);
    publisher_.watch_stretch(kBound);
  }
  /// Moves the vertices from `vertex` on along the strand, so that the segment before it is `by` longer than
  /// at rest, relative.
  void stretch(uint32_t strand, uint32_t vertex, double by) {
    for (uint32_t i = 0; i < kVertices; ++i) {
      const glm::dvec3 moved(0.0, 0.0, i >= vertex && vertex > 0 ? kSegmentM * by : 0.0);
      const glm::dvec3 point = glm::dvec3(rest_of(groom_, strand, i)) + moved;
      solver_.state.position_m[index(strand, i)] = glm::vec3(some_rotation() * point);
    }
  }
  /// Publishes as a simulation at `time_s` would, and repairs.
  void publish_at(double time_s) {
    input_.sim_time_ns = std::llround(time_s * 1e9);
    publisher_.publish(solver_, input_);
    if (!publisher_.quarantined().empty()) publisher_.repair(solver_);
  }

  static constexpr double kBound = 0.25;     // limit 1.0: twice the length
  static constexpr double kSegmentM = 0.05;  // of straight_groom()
};

TEST_F(OverStretch, TheLimitIsRelativeToTheRowsBoundWithAFloor) {
  EXPECT_EQ(overstretch_limit(0.0), kLeastOverstretch);
  EXPECT_EQ(overstretch_limit(kBound), kOverstretchPerBound * kBound);
}

TEST_F(OverStretch, LastingOverStretchIsPutBackToRestAndCountedApart) {
  const double limit = overstretch_limit(kBound);
  stretch(1, 2, 0.98 * limit);
  stretch(3, 2, 1.02 * limit);
  const SolverState before = solver_.state;
  const double patience_s = static_cast<double>(kOverstretchPatienceNs) * 1e-9;
  for (const double time_s : {0.0, 0.5 * patience_s, 0.99 * patience_s}) {
    publish_at(time_s);
    EXPECT_THAT(publisher_.quarantined(), IsEmpty()) << time_s;
  }
  publish_at(patience_s);
  EXPECT_THAT(publisher_.quarantined(), ElementsAre(3u));
  EXPECT_EQ(publisher_.overstretch_count(), 1u);
  EXPECT_EQ(publisher_.quarantine_count(), 0u);
  for (uint32_t vertex = 0; vertex < kVertices; ++vertex) {
    const size_t repaired = index(3, vertex);
    const glm::vec3 rest(some_rotation() * glm::dvec3(rest_of(groom_, 3, vertex)));
    EXPECT_LE(glm::length(solver_.state.position_m[repaired] - rest), 1e-6f);
    for (const uint32_t neighbour : {0u, 1u, 2u, 4u}) {
      const size_t i = index(neighbour, vertex);
      EXPECT_EQ(solver_.state.position_m[i], before.position_m[i]) << neighbour;
      EXPECT_EQ(solver_.state.velocity_mps[i], before.velocity_mps[i]) << neighbour;
    }
  }
  publish_at(2.0 * patience_s);
  EXPECT_THAT(publisher_.quarantined(), IsEmpty()) << "one repair is enough";
}

TEST_F(OverStretch, AJoltThatSnapsBackIsLeftAlone) {
  for (int step = 0; step < 60; ++step) {
    stretch(2, 1, step % 10 == 9 ? 0.0 : 5.0);  // back within the limit every sixth of a second
    publish_at(step / 60.0);
    ASSERT_THAT(publisher_.quarantined(), IsEmpty()) << step;
  }
  EXPECT_EQ(publisher_.overstretch_count(), 0u);
}

TEST_F(OverStretch, ARunawayStrandIsPutBackAtOnceToMoveWithTheHead) {
  stretch(2, 3, 1.1 * kRunawayStretch);
  input_.head_velocity_mps = {3.0, -1.0, 2.0};
  publish_at(0.0);
  EXPECT_THAT(publisher_.quarantined(), ElementsAre(2u));
  EXPECT_EQ(publisher_.overstretch_count(), 1u);
  EXPECT_EQ(solver_.state.velocity_mps[index(2, 1)], glm::vec3(3.0f, -1.0f, 2.0f));
}

TEST_F(OverStretch, ABrokenStrandCountsAsBrokenOnly) {
  solver_.state.position_m[index(4, 1)].x = kNan;
  solver_.state.position_m[index(0, 2)].x = 3.0f * kMaxStrandReachM;
  publish_at(0.0);
  EXPECT_THAT(publisher_.quarantined(), ElementsAre(0u, 4u));
  EXPECT_EQ(publisher_.quarantine_count(), 2u);
  EXPECT_EQ(publisher_.overstretch_count(), 0u);
}

TEST_F(Publishing, SegmentsOfNearlyNoLengthDoNotCountAsStretched) {
  Groom groom = straight_groom();
  for (uint32_t strand = 0; strand < kStrands; ++strand)  // the third vertex on the second
    groom.rest_position_m[groom.offset[strand] + 2] = groom.rest_position_m[groom.offset[strand] + 1];
  Publisher publisher(groom, kBoundM);
  publisher.watch_stretch(0.0);
  for (uint32_t strand = 0; strand < kStrands; ++strand)
    for (uint32_t vertex = 0; vertex < kVertices; ++vertex)
      solver_.state.position_m[index(strand, vertex)] =
          rest_of(groom, strand, vertex) + glm::vec3(0.0f, 0.0f, vertex == 2 ? 1e-4f : 0.0f);
  for (int second = 0; second < 5; ++second) {
    input_.sim_time_ns = second * 1'000'000'000LL;
    publisher.publish(solver_, input_);
    EXPECT_THAT(publisher.quarantined(), IsEmpty());
  }
}

TEST_F(Publishing, TheReadBackBufferIsReused) {
  publisher_.publish(solver_, input_);
  const void* first = solver_.read_target;
  publisher_.publish(solver_, input_);
  EXPECT_EQ(solver_.read_target, first);
}

std::shared_ptr<const Snapshot> numbered(uint64_t tick) {
  auto snapshot = std::make_shared<Snapshot>();
  snapshot->tick = tick;
  return snapshot;
}

TEST(SnapshotSlot, TheLatestWinsAndVersionsCountEveryPut) {
  SnapshotSlot slot;
  EXPECT_EQ(slot.latest().snapshot, nullptr);
  for (uint64_t tick = 1; tick <= 3; ++tick) slot.put(numbered(tick));
  EXPECT_EQ(slot.latest().snapshot->tick, 3u);
  EXPECT_EQ(slot.latest().version, 3u);
}

TEST(SnapshotSlot, AReaderSeesTicksInOrderAndTheLastOne) {
  SnapshotSlot slot;
  constexpr uint64_t kLast = 20'000;
  std::thread writer([&] {
    for (uint64_t tick = 1; tick <= kLast; ++tick) slot.put(numbered(tick));
  });
  uint64_t version = 0, tick = 0;
  while (tick < kLast) {
    const auto view = slot.wait([&](const SnapshotSlot::View& now) { return now.version > version; });
    EXPECT_GT(view.snapshot->tick, tick);
    version = view.version;
    tick = view.snapshot->tick;
  }
  writer.join();
}

TEST(SnapshotSlot, StopAndNotifyWakeReaders) {
  SnapshotSlot slot;
  std::atomic<bool> is_wanted{false};
  std::atomic<bool> was_woken{false};
  std::thread reader([&] {
    const auto notified = slot.wait([&](const SnapshotSlot::View&) { return is_wanted.load(); });
    EXPECT_FALSE(notified.is_stopped);
    was_woken = true;
    EXPECT_TRUE(slot.wait([](const SnapshotSlot::View&) { return false; }).is_stopped);
  });
  is_wanted = true;
  slot.notify();
  EXPECT_TRUE(eventually([&] { return was_woken.load(); }));
  slot.stop();
  reader.join();
}

}  // namespace
}  // namespace strandcast::publisher_test

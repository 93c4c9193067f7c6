// Samples in lockstep: for which simulated time each is, whenever it arrives.
#include "server/input/held_inputs.h"
#include "common/base/units.h"

#include "server/input/input_hub.h"

namespace strandcast::held_inputs_test {
namespace {
constexpr int64_t kOdd = 123'456'789'000;  // where some source's clock happens to be

MotionSamples motion_at(std::initializer_list<int64_t> times_ns, double slope_per_ns = 1e-9) {
  MotionSamples message;
  for (const int64_t time_ns : times_ns)
    message.samples.push_back(
        {time_ns, {{static_cast<double>(time_ns) * slope_per_ns, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}}});
  return message;
}

TEST(HeldInputs, TheFirstSampleIsForNowAndTheOthersFollowIt) {
  HeldInputs held;
  EXPECT_EQ(held.hold(1, motion_at({kOdd, kOdd + 10 * kMsInNs, kOdd + 20 * kMsInNs}), 500 * kMsInNs), 0u);
  const auto now = held.take_due(500 * kMsInNs);
  ASSERT_EQ(now.size(), 1u);
  EXPECT_EQ(now[0].arrival_ns, 500 * kMsInNs);
  const auto next = held.take_due(515 * kMsInNs);
  ASSERT_EQ(next.size(), 1u);
  EXPECT_EQ(next[0].arrival_ns, 510 * kMsInNs);
  EXPECT_EQ(held.take_due(1'000 * kMsInNs).size(), 1u);
}

TEST(HeldInputs, SourcesAreMergedByTime) {
  HeldInputs held;
  held.hold(2, motion_at({0, 30 * kMsInNs}), 0);
  WindSamples wind;
  wind.samples = {{kOdd, {1.0f, 0.0f, 0.0f}}, {kOdd + 20 * kMsInNs, {2.0f, 0.0f, 0.0f}}};
  held.hold(1, wind, 0);
  const auto due = held.take_due(100 * kMsInNs);
  ASSERT_EQ(due.size(), 4u);
  for (size_t i = 1; i < due.size(); ++i) EXPECT_LE(due[i - 1].arrival_ns, due[i].arrival_ns);
  EXPECT_EQ(due[2].source_id, 1u);
  EXPECT_EQ(due[3].source_id, 2u);
}

TEST(HeldInputs, AClockThatJumpsBeginsAnewAtTheSimulationsTime) {
  HeldInputs held;
  held.hold(1, motion_at({kOdd}), 0);
  held.take_due(0);
  // Nobody stepped for a minute, in which the source's clock went on.
  held.hold(1, motion_at({kOdd + 60'000 * kMsInNs}), 40 * kMsInNs);
  EXPECT_EQ(held.take_due(40 * kMsInNs).size(), 1u);
  held.hold(1, motion_at({5}), 50 * kMsInNs);  // started again
  EXPECT_EQ(held.take_due(50 * kMsInNs).size(), 1u);
}

TEST(HeldInputs, WhatWaitsOutlivesItsSource) {
  HeldInputs held;
  held.hold(7, motion_at({0, 10 * kMsInNs}), 0);
  held.leave(7);
  EXPECT_EQ(held.take_due(0).size(), 1u);
  EXPECT_TRUE(held.take_left().empty());
  EXPECT_EQ(held.take_due(10 * kMsInNs).size(), 1u);
  EXPECT_EQ(held.take_left(), std::vector<uint64_t>{7});
  EXPECT_TRUE(held.take_left().empty());
}

TEST(HeldInputs, IsBounded) {
  HeldInputs held;
  uint64_t refused = 0;
  for (size_t i = 0; i < kMaxHeldSamples + 10; ++i)
    refused += held.hold(1, motion_at({static_cast<int64_t>(i) * kMsInNs}), 0);
  EXPECT_EQ(refused, 10u);
  EXPECT_EQ(held.take_due(INT64_MAX - kHeldSlackNs).size(), kMaxHeldSamples);
  for (uint64_t source = 2; source < 2 + kMaxInputSources; ++source)
    refused += held.hold(source, motion_at({0}), 0);
  EXPECT_EQ(refused, 11u) << "one source is there already";
}

// The same samples and steps give the same frames, whatever the messages and moments that they come in.
TEST(HeldInputs, FramesDependOnSampleTimesOnly) {
  const auto frames = [](size_t samples_per_message, int64_t arrival_ns) {
    InputHub hub;
    hub.hold_samples();
    std::vector<Pose> poses;
    int64_t sent = 0;
    for (int64_t step = 1; step <= 30; ++step) {
      // Always ahead of the step, by how much does not matter.
      while (sent < std::min<int64_t>(31, step + static_cast<int64_t>(samples_per_message))) {
        MotionSamples message;
        for (size_t i = 0; i < samples_per_message && sent < 31; ++i, ++sent)
          message.samples.push_back(motion_at({kOdd + sent * 4 * kMsInNs}, 1e-10).samples[0]);
        hub.push(1, message, arrival_ns);
      }
      poses.push_back(hub.sample(step * 4 * kMsInNs).world_from_head);
    }
    return poses;
  };
  const std::vector<Pose> one_by_one = frames(1, 5);
  EXPECT_EQ(frames(7, 999'999'999'999), one_by_one);
  EXPECT_EQ(frames(31, -3), one_by_one);
  for (size_t i = 1; i < one_by_one.size(); ++i)
    EXPECT_NEAR(one_by_one[i].position_m.x - one_by_one[i - 1].position_m.x, 4 * kMsInNs * 1e-10, 1e-12)
        << "each step has its own sample";
}

}  // namespace
}  // namespace strandcast::held_inputs_test

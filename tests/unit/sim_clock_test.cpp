// Laws of the step clock: no step is lost at real time, late steps are bounded and counted, pauses are exact.
#include "server/scene/sim_clock.h"
#include "common/base/units.h"

#include <gtest/gtest.h>

namespace strandcast::sim_clock_test {
namespace {
constexpr int64_t kStart = 5 * kSInNs;

/// Steps taken when the clock is asked every `poll_ns`.
int count_steps(SimClock& clock, int64_t from_ns, int64_t to_ns, int64_t poll_ns) {
  int count = 0;
  for (int64_t time_ns = from_ns; time_ns <= to_ns; time_ns += poll_ns)
    while (clock.take_step(time_ns)) ++count;
  return count;
}

TEST(SimClock, TakesExactlyTheStepsOfRealTime) {
  SimClock clock(1.0 / 60.0, kStart);
  EXPECT_FALSE(clock.take_step(kStart).has_value());
  EXPECT_EQ(count_steps(clock, kStart, kStart + 100 * kSInNs, kMsInNs), 6'000);
  EXPECT_EQ(clock.dropped_steps(), 0u);
  EXPECT_NEAR(clock.realtime_factor(kStart + 100 * kSInNs), 1.0, 0.02);
}

TEST(SimClock, StepsStandForEvenlySpacedTimesHoweverLateTheyAreTaken) {
  SimClock clock(0.01, 0);
  int64_t expected_ns = 10 * kMsInNs;
  for (int64_t time_ns = 0; time_ns < kSInNs; time_ns += 23 * kMsInNs) {
    while (const auto step_ns = clock.take_step(time_ns)) {
      EXPECT_EQ(*step_ns, expected_ns);
      expected_ns += 10 * kMsInNs;
    }
  }
}

TEST(SimClock, CatchesUpAFewStepsAndDropsAndCountsTheRest) {
  SimClock clock(0.01, 0);
  int taken = 0;
  while (clock.take_step(kSInNs)) ++taken;
  EXPECT_EQ(taken, kMaxCatchUpSteps);
  EXPECT_EQ(clock.dropped_steps(), 100u - kMaxCatchUpSteps);
  // Afterwards it is on time again.
  EXPECT_FALSE(clock.take_step(kSInNs + 9 * kMsInNs).has_value());
  EXPECT_TRUE(clock.take_step(kSInNs + 10 * kMsInNs).has_value());
}

TEST(SimClock, ReportsHalfRealTimeWhenEachStepTakesTwoSteps) {
  SimClock clock(0.01, 0);
  int64_t time_ns = 0;
  while (time_ns < 5 * kSInNs) {
    (void)clock.take_step(time_ns);
    time_ns += 20 * kMsInNs;
  }
  EXPECT_NEAR(clock.realtime_factor(time_ns), 0.5, 0.02);
  EXPECT_GT(clock.dropped_steps(), 200u);
}

// Less than the second that it looks back: of the time since it runs.
TEST(SimClock, ReportsItsPaceSoonAfterItBegins) {
  SimClock clock(0.01, kStart);
  count_steps(clock, kStart, kStart + kSInNs / 4, kMsInNs);
  EXPECT_NEAR(clock.realtime_factor(kStart + kSInNs / 4), 1.0, 0.05);
  clock.pause();
  clock.resume(kStart + 9 * kSInNs);
  count_steps(clock, kStart + 9 * kSInNs, kStart + 9 * kSInNs + kSInNs / 4, kMsInNs);
  EXPECT_NEAR(clock.realtime_factor(kStart + 9 * kSInNs + kSInNs / 4), 1.0, 0.05);
}

TEST(SimClock, PauseStepAndResumeAreExact) {
  SimClock clock(0.01, 0);
  EXPECT_FALSE(clock.add_single_steps(1)) << "it runs";
  clock.pause();
  EXPECT_FALSE(clock.take_step(kSInNs).has_value());
  EXPECT_FALSE(clock.next_due_ns().has_value());
  EXPECT_EQ(clock.realtime_factor(kSInNs), 0.0);
  EXPECT_TRUE(clock.add_single_steps(2));
  EXPECT_TRUE(clock.take_step(kSInNs).has_value());
  EXPECT_TRUE(clock.take_step(kSInNs).has_value());
  EXPECT_FALSE(clock.take_step(kSInNs).has_value());
  clock.resume(10 * kSInNs);
  EXPECT_FALSE(clock.take_step(10 * kSInNs).has_value()) << "a pause is not caught up";
  EXPECT_EQ(clock.next_due_ns(), 10 * kSInNs + 10 * kMsInNs);
  EXPECT_TRUE(clock.take_step(10 * kSInNs + 10 * kMsInNs).has_value());
  EXPECT_EQ(clock.dropped_steps(), 0u);
}

// Nobody needs the steps: time passes in them as ever, and nothing is late afterwards.
TEST(SimClock, SkippedStepsPassAndAreNeitherLateNorDropped) {
  SimClock clock(0.01, kStart);
  EXPECT_EQ(clock.skip(kStart + 5 * kMsInNs), 0u);
  EXPECT_EQ(clock.skip(kStart + kSInNs / 2), 50u);
  EXPECT_EQ(clock.skip(kStart + kSInNs / 2), 0u);
  EXPECT_EQ(clock.skip(kStart + 20 * kSInNs), 1'950u);
  EXPECT_NEAR(clock.realtime_factor(kStart + 20 * kSInNs), 1.0, 0.02) << "no slow motion";
  EXPECT_EQ(clock.dropped_steps(), 0u);
  EXPECT_EQ(clock.take_step(kStart + 20 * kSInNs), std::nullopt);
  EXPECT_EQ(clock.take_step(kStart + 20 * kSInNs + 10 * kMsInNs), kStart + 20 * kSInNs + 10 * kMsInNs);
  clock.pause();
  EXPECT_EQ(clock.skip(kStart + 30 * kSInNs), 0u);
}

}  // namespace
}  // namespace strandcast::sim_clock_test

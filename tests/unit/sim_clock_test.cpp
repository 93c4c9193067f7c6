// Laws of the step clock: no step is lost at real time, late steps are bounded and counted, pauses are exact.
#include "server/scene/sim_clock.h"

#include <gtest/gtest.h>

namespace strandcast {
namespace {

constexpr int64_t kMsNs = 1'000'000;
constexpr int64_t kSecondNs = 1'000 * kMsNs;
constexpr int64_t kStart = 5 * kSecondNs;

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
  EXPECT_EQ(count_steps(clock, kStart, kStart + 100 * kSecondNs, kMsNs), 6'000);
  EXPECT_EQ(clock.dropped_steps(), 0u);
  EXPECT_NEAR(clock.realtime_factor(kStart + 100 * kSecondNs), 1.0, 0.02);
}

TEST(SimClock, StepsStandForEvenlySpacedTimesHoweverLateTheyAreTaken) {
  SimClock clock(0.01, 0);
  int64_t expected_ns = 10 * kMsNs;
  for (int64_t time_ns = 0; time_ns < kSecondNs; time_ns += 23 * kMsNs) {
    while (const auto step_ns = clock.take_step(time_ns)) {
      EXPECT_EQ(*step_ns, expected_ns);
      expected_ns += 10 * kMsNs;
    }
  }
}

TEST(SimClock, CatchesUpAFewStepsAndDropsAndCountsTheRest) {
  SimClock clock(0.01, 0);
  int taken = 0;
  while (clock.take_step(kSecondNs)) ++taken;
  EXPECT_EQ(taken, kMaxCatchUpSteps);
  EXPECT_EQ(clock.dropped_steps(), 100u - kMaxCatchUpSteps);
  // Afterwards it is on time again.
  EXPECT_FALSE(clock.take_step(kSecondNs + 9 * kMsNs).has_value());
  EXPECT_TRUE(clock.take_step(kSecondNs + 10 * kMsNs).has_value());
}

TEST(SimClock, ReportsHalfRealTimeWhenEachStepTakesTwoSteps) {
  SimClock clock(0.01, 0);
  int64_t time_ns = 0;
  while (time_ns < 5 * kSecondNs) {
    (void)clock.take_step(time_ns);
    time_ns += 20 * kMsNs;
  }
  EXPECT_NEAR(clock.realtime_factor(time_ns), 0.5, 0.02);
  EXPECT_GT(clock.dropped_steps(), 200u);
}

// Less than the second that it looks back: of the time since it runs.
TEST(SimClock, ReportsItsPaceSoonAfterItBegins) {
  SimClock clock(0.01, kStart);
  count_steps(clock, kStart, kStart + kSecondNs / 4, kMsNs);
  EXPECT_NEAR(clock.realtime_factor(kStart + kSecondNs / 4), 1.0, 0.05);
  clock.pause();
  clock.resume(kStart + 9 * kSecondNs);
  count_steps(clock, kStart + 9 * kSecondNs, kStart + 9 * kSecondNs + kSecondNs / 4, kMsNs);
  EXPECT_NEAR(clock.realtime_factor(kStart + 9 * kSecondNs + kSecondNs / 4), 1.0, 0.05);
}

TEST(SimClock, PauseStepAndResumeAreExact) {
  SimClock clock(0.01, 0);
  EXPECT_FALSE(clock.add_single_steps(1)) << "it runs";
  clock.pause();
  EXPECT_FALSE(clock.take_step(kSecondNs).has_value());
  EXPECT_FALSE(clock.next_due_ns().has_value());
  EXPECT_EQ(clock.realtime_factor(kSecondNs), 0.0);
  EXPECT_TRUE(clock.add_single_steps(2));
  EXPECT_TRUE(clock.take_step(kSecondNs).has_value());
  EXPECT_TRUE(clock.take_step(kSecondNs).has_value());
  EXPECT_FALSE(clock.take_step(kSecondNs).has_value());
  clock.resume(10 * kSecondNs);
  EXPECT_FALSE(clock.take_step(10 * kSecondNs).has_value()) << "a pause is not caught up";
  EXPECT_EQ(clock.next_due_ns(), 10 * kSecondNs + 10 * kMsNs);
  EXPECT_TRUE(clock.take_step(10 * kSecondNs + 10 * kMsNs).has_value());
  EXPECT_EQ(clock.dropped_steps(), 0u);
}

// Nobody needs the steps: time passes in them as ever, and nothing is late afterwards.
TEST(SimClock, SkippedStepsPassAndAreNeitherLateNorDropped) {
  SimClock clock(0.01, kStart);
  EXPECT_EQ(clock.skip(kStart + 5 * kMsNs), 0u);
  EXPECT_EQ(clock.skip(kStart + kSecondNs / 2), 50u);
  EXPECT_EQ(clock.skip(kStart + kSecondNs / 2), 0u);
  EXPECT_EQ(clock.skip(kStart + 20 * kSecondNs), 1'950u);
  EXPECT_NEAR(clock.realtime_factor(kStart + 20 * kSecondNs), 1.0, 0.02) << "no slow motion";
  EXPECT_EQ(clock.dropped_steps(), 0u);
  EXPECT_EQ(clock.take_step(kStart + 20 * kSecondNs), std::nullopt);
  EXPECT_EQ(clock.take_step(kStart + 20 * kSecondNs + 10 * kMsNs), kStart + 20 * kSecondNs + 10 * kMsNs);
  clock.pause();
  EXPECT_EQ(clock.skip(kStart + 30 * kSecondNs), 0u);
}

}  // namespace
}  // namespace strandcast

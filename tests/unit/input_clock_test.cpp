// Laws of the clock of the inputs: what the step stands for in real time, smooth where steps are left out,
// never early, never far behind.
#include "server/scene/input_clock.h"
#include "common/base/units.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "server/scene/sim_clock.h"

namespace strandcast::input_clock_test {
namespace {

constexpr double kStepS = 1.0 / 60.0;
constexpr double kStepNs = kStepS * 1e9;

/// The due time of step `index` when `every` steps of real time pass for each that is taken.
int64_t due_ns(int index, double every = 1.0) {
  return kSInNs + std::llround(std::floor(index * every) * kStepNs);
}

TEST(InputClock, IsTheTimeOfTheStepInRealTime) {
  InputClock clock(kStepS);
  for (int i = 0; i < 10'000; ++i) {
    EXPECT_EQ(clock.next(due_ns(i)), due_ns(i));
    EXPECT_EQ(clock.rate(), 1.0);
  }
}

TEST(InputClock, GoesOnSmoothlyWhereEveryThirdStepIsMissing) {
  InputClock clock(kStepS);
  constexpr double kEvery = 1.5;
  int64_t last_ns = 0;
  double slowest = 1e9, fastest = 0.0;
  for (int i = 0; i < 600; ++i) {
    const int64_t time_ns = clock.next(due_ns(i, kEvery));
    EXPECT_LE(time_ns, due_ns(i, kEvery)) << "never early";
    if (i > 300) {
      const double rate = static_cast<double>(time_ns - last_ns) / kStepNs;
      EXPECT_NEAR(rate, clock.rate(), 1e-6);
      slowest = std::min(slowest, rate);
      fastest = std::max(fastest, rate);
    }
    last_ns = time_ns;
  }
  // The due times themselves go on by one step and by two in turn.
  EXPECT_GT(slowest, kEvery - kCatchUpShare / 2);
  EXPECT_LT(fastest, kEvery + kCatchUpShare / 2);
}

TEST(InputClock, StaysAsFarBehindAsItSays) {
  for (const double every : {2.0, 3.0, 5.0}) {
    InputClock clock(kStepS);
    int64_t behind_ns = 0;
    for (int i = 0; i < 400; ++i) behind_ns = due_ns(i, every) - clock.next(due_ns(i, every));
    EXPECT_NEAR(static_cast<double>(behind_ns) / kStepNs, (every - 1.0) * (1.0 / kCatchUpShare - 1.0), 1e-3);
    EXPECT_NEAR(clock.rate(), every, 1e-6);
  }
}

TEST(InputClock, CatchesUpAfterAStopAndIsThenOnTime) {
  InputClock clock(kStepS);
  for (int i = 0; i < 10; ++i) clock.next(due_ns(i));
  constexpr int kMissed = 30;
  int64_t behind_ns = 0;
  for (int i = 0; i < 5; ++i) behind_ns = due_ns(10 + kMissed + i) - clock.next(due_ns(10 + kMissed + i));
  EXPECT_NEAR(static_cast<double>(behind_ns) / kStepNs, kMissed * std::pow(1.0 - kCatchUpShare, 5), 1e-3);
  for (int i = 5; i < 120; ++i) clock.next(due_ns(10 + kMissed + i));
  for (int i = 120; i < 130; ++i) {
    EXPECT_EQ(clock.next(due_ns(10 + kMissed + i)), due_ns(10 + kMissed + i)) << "exactly";
    EXPECT_EQ(clock.rate(), 1.0);
  }
}

TEST(InputClock, LeapsOverALongStopAndSaysHowFar) {
  InputClock clock(kStepS);
  clock.next(due_ns(0));
  EXPECT_EQ(clock.next(due_ns(200)), due_ns(200));
  EXPECT_NEAR(clock.rate(), 200.0, 1e-6);
  EXPECT_EQ(clock.next(due_ns(201)), due_ns(201));
  EXPECT_EQ(clock.rate(), 1.0);
}

TEST(InputClock, APauseIsNotCaughtUp) {
  InputClock clock(kStepS);
  for (int i = 0; i < 10; ++i) clock.next(due_ns(i, 2.0));
  clock.restart();
  EXPECT_EQ(clock.next(due_ns(50)), due_ns(50));
  EXPECT_EQ(clock.rate(), 1.0);
  EXPECT_EQ(clock.next(due_ns(51)), due_ns(51));
}

// What the step clock hands out is what this clock is made for.
TEST(InputClock, FollowsASimulationAtTwoThirdsOfRealTime) {
  SimClock steps(0.01, 0);
  InputClock inputs(0.01);
  int64_t time_ns = 0, input_ns = 0;
  for (int i = 0; i < 1000; ++i) {
    time_ns += 15'000'000;  // what a step takes
    if (const auto due = steps.take_step(time_ns)) input_ns = inputs.next(*due);
  }
  EXPECT_NEAR(inputs.rate(), 1.5, kCatchUpShare / 2);
  EXPECT_LT(std::llabs(time_ns - input_ns), 120'000'000);
}

}  // namespace
}  // namespace strandcast::input_clock_test

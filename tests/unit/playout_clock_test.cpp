#include "common/replay/playout_clock.h"
#include "common/base/units.h"

#include <cmath>

#include "common/base/hash.h"

namespace strandcast::playout_clock_test {
namespace {
constexpr int64_t kStepNs = 16'666'667;
constexpr int64_t kStartNs = 5'000'000'000'000;  // client clocks do not start at zero

TEST(PlayoutClock, StaysOneFrameBehindAnEvenStream) {
  PlayoutClock clock;
  EXPECT_FALSE(clock.has_value());
  for (int64_t i = 0; i < 100; ++i) clock.add(kStartNs + i * kStepNs, i * kStepNs);
  ASSERT_TRUE(clock.has_value());
  EXPECT_NEAR(static_cast<double>(clock.delay_ns()), kStepNs, 1000.0);
  const int64_t now_ns = kStartNs + 99 * kStepNs + 4 * kMsInNs;
  EXPECT_NEAR(static_cast<double>(clock.sim_time_at(now_ns)), 98.0 * kStepNs + 4 * kMsInNs, 1000.0);
}

TEST(PlayoutClock, StaysTwoFramesBehindASlowStreamForTheCubic) {
  const auto behind = [](double hz, double realtime, uint32_t now) {
    return frames_behind(1e9 / hz, 1e9 / (hz * realtime), now);
  };
  EXPECT_EQ(behind(60.0, 1.0, 1), 1u);
  EXPECT_EQ(behind(50.5, 1.0, 2), 1u);
  EXPECT_EQ(behind(47.0, 1.0, 1), 1u) << "in between it stays";
  EXPECT_EQ(behind(47.0, 1.0, 2), 2u);
  EXPECT_EQ(behind(44.5, 1.0, 1), 2u);
  EXPECT_EQ(behind(30.0, 1.0, 1), 2u);
  EXPECT_EQ(behind(20.0, 1.0, 1), 2u);
  EXPECT_EQ(behind(15.0, 1.0, 2), 1u) << "67 ms more is too much";
  EXPECT_EQ(behind(30.0, 0.5, 2), 1u) << "so it is in slow motion";
  EXPECT_EQ(behind(60.0, 0.5, 1), 1u) << "states as near as at 60 Hz err little on lines";
  PlayoutClock clock;
  for (int64_t i = 0; i < 100; ++i) clock.add(kStartNs + 2 * i * kStepNs, 2 * i * kStepNs);
  EXPECT_NEAR(static_cast<double>(clock.delay_ns()), 4.0 * kStepNs, 1e4);
}

TEST(PlayoutClock, AStreamThatBecomesSlowerShowsInAFewFrames) {
  PlayoutClock clock;
  int64_t tick = 0;
  for (; tick < 100; ++tick) clock.add(kStartNs + tick * kStepNs, tick * kStepNs);
  for (int i = 0; i < 5; ++i, tick += 2) clock.add(kStartNs + tick * kStepNs, tick * kStepNs);
  EXPECT_GE(clock.delay_ns(), 2 * kStepNs);
  // One frame that was lost is none of that.
  PlayoutClock lossy;
  for (tick = 0; tick < 100; tick += tick == 96 ? 2 : 1) lossy.add(kStartNs + tick * kStepNs, tick * kStepNs);
  EXPECT_LT(lossy.delay_ns(), kStepNs + 2 * kMsInNs);
}

TEST(PlayoutClock, FollowsASlowServer) {
  PlayoutClock clock;
  for (int64_t i = 0; i < 100; ++i)
    clock.add(kStartNs + 3 * i * kStepNs, i * kStepNs);  // a third of real time
  const int64_t now_ns = kStartNs + 3 * 99 * kStepNs;
  const int64_t later_ns = now_ns + 30 * kMsInNs;
  EXPECT_NEAR(static_cast<double>(clock.sim_time_at(later_ns) - clock.sim_time_at(now_ns)), 10.0 * kMsInNs,
              0.05 * kMsInNs);
  EXPECT_NEAR(static_cast<double>(clock.sim_time_at(now_ns)), 98.0 * kStepNs, 0.1 * kMsInNs);
}

TEST(PlayoutClock, JitterGrowsTheDelayButNotBeyondItsLimit) {
  for (const int64_t jitter_ns : {5 * kMsInNs, 20 * kMsInNs, 1000 * kMsInNs}) {
    PlayoutClock clock;
    int64_t last_ns = 0;
    for (int64_t i = 0; i < 200; ++i) {
      const double late = unit_float(mix_u32(static_cast<uint32_t>(i)));
      // Frames keep their order: a late one holds up those behind it.
      last_ns = std::max(
          last_ns, kStartNs + i * kStepNs + static_cast<int64_t>(late * static_cast<double>(jitter_ns)));
      clock.add(last_ns, i * kStepNs);
    }
    EXPECT_GT(clock.delay_ns(), kStepNs + std::min(jitter_ns / 8, 10 * kMsInNs)) << jitter_ns;
    EXPECT_LE(clock.delay_ns(), kMaxPlayoutDelayNs + 2 * kStepNs) << jitter_ns;
  }
}

TEST(PlayoutClock, SmoothPlayoutNeedsNoFrameThatIsNotThereYet) {
  PlayoutClock clock;
  int shown = 0;
  int starved = 0;
  for (int64_t i = 0; i < 400; ++i) {
    const double late = unit_float(mix_u32(static_cast<uint32_t>(i) + 77u));
    clock.add(kStartNs + i * kStepNs + static_cast<int64_t>(late * 8.0 * kMsInNs), i * kStepNs);
    if (i < 64) continue;
    // Just before the next frame comes at its latest, playout must still be within what has arrived.
    const double next_late = unit_float(mix_u32(static_cast<uint32_t>(i) + 78u));
    const int64_t before_next_ns =
        kStartNs + (i + 1) * kStepNs + static_cast<int64_t>(next_late * 8.0 * kMsInNs) - 1;
    ++shown;
    if (clock.sim_time_at(before_next_ns) > i * kStepNs) ++starved;
  }
  EXPECT_LT(starved, shown / 10) << "the delay covers 95 % of lateness";
}

TEST(PlayoutClock, ForgetsThePastAfterAResetOrAPause) {
  PlayoutClock clock;
  for (int64_t i = 0; i < 50; ++i) clock.add(kStartNs + i * kStepNs, i * kStepNs);
  clock.add(kStartNs + 50 * kStepNs, 0);
  EXPECT_FALSE(clock.has_value());
  for (int64_t i = 1; i < 10; ++i) clock.add(kStartNs + (50 + i) * kStepNs, i * kStepNs);
  ASSERT_TRUE(clock.has_value());
  clock.add(kStartNs + 60 * kStepNs + kPlayoutGapNs, 10 * kStepNs);
  EXPECT_FALSE(clock.has_value());
}

TEST(PlayoutClock, SurvivesABurstAndEqualTimes) {
  PlayoutClock clock;
  for (int64_t i = 0; i < 100; ++i) clock.add(kStartNs, i * kStepNs);
  EXPECT_TRUE(std::isfinite(static_cast<double>(clock.sim_time_at(kStartNs + kMsInNs))));
  EXPECT_LE(clock.delay_ns(), kMaxPlayoutDelayNs);
}

TEST(PlayoutCursor, CatchesUpWithoutJumpFreezeOrStepBack) {
  // Wanted time jumps ahead or back once; the shown time must run on, within its limits, and meet it.
  for (const int64_t jump_ns : {300 * kMsInNs, -300 * kMsInNs}) {
    PlayoutCursor cursor;
    int64_t shown_ns = cursor.advance(kStartNs, 0);
    for (int64_t t_ns = kMsInNs; t_ns <= 2'000 * kMsInNs; t_ns += kMsInNs) {
      const int64_t wanted_ns = t_ns + (t_ns > 500 * kMsInNs ? jump_ns : 0);
      const int64_t next_ns = cursor.advance(kStartNs + t_ns, wanted_ns);
      const auto moved = static_cast<double>(next_ns - shown_ns) / kMsInNs;
      EXPECT_GE(moved, 1.0 - kCatchUpRate - 1e-3) << t_ns / kMsInNs;
      EXPECT_LE(moved, 2.0 + kCatchUpRate + 1e-3) << t_ns / kMsInNs;
      shown_ns = next_ns;
    }
    EXPECT_NEAR(static_cast<double>(shown_ns), 2'000.0 * kMsInNs + static_cast<double>(jump_ns),
                2.0 * kMsInNs);
  }
}

TEST(PlayoutCursor, JumpsOnlyOverLargeDifferences) {
  PlayoutCursor cursor;
  EXPECT_EQ(cursor.advance(kStartNs, 7), 7);
  EXPECT_EQ(cursor.advance(kStartNs + kMsInNs, 10 * kCatchUpLimitNs), 10 * kCatchUpLimitNs);
  EXPECT_EQ(cursor.advance(kStartNs + 2 * kMsInNs, 0), 0);
}

}  // namespace
}  // namespace strandcast::playout_clock_test

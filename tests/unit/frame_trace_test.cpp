// Percentiles of the way of frames, and their CSV.
#include "client/app/frame_trace.h"

#include <gmock/gmock.h>

#include "common/base/file.h"
#include "tests/support/temporary_folder.h"

namespace strandcast {
namespace {

constexpr int64_t kMs = 1'000'000;

FrameTimes frame(uint64_t tick, int64_t motion_ns) {
  FrameTimes times;
  times.tick = tick;
  times.motion_ns = motion_ns;
  times.sent_ns = motion_ns + 10 * kMs;
  times.received_ns = times.sent_ns + static_cast<int64_t>(tick) * kMs;
  times.decoded_ns = times.received_ns + 2 * kMs;
  return times;
}

TEST(FrameTrace, SaysHowLongEachPartOfTheWayTakes) {
  std::vector<FrameTimes> frames;
  for (uint64_t tick = 1; tick <= 101; ++tick)
    frames.push_back(frame(tick, static_cast<int64_t>(tick) * 100 * kMs));
  const auto stages = stage_times(frames);
  ASSERT_EQ(stages.size(), 4u);
  EXPECT_EQ(stages[0].stage, "motion received -> sent");
  EXPECT_DOUBLE_EQ(stages[0].median_ms, 10.0);
  EXPECT_EQ(stages[1].count, 101u);
  EXPECT_DOUBLE_EQ(stages[1].median_ms, 51.0);
  EXPECT_DOUBLE_EQ(stages[1].p90_ms, 91.0);
  EXPECT_DOUBLE_EQ(stages[1].most_ms, 101.0);
  EXPECT_DOUBLE_EQ(stages[2].p99_ms, 2.0);
  EXPECT_DOUBLE_EQ(stages[3].median_ms, 63.0);
}

// A sample that stays in later states because no other comes is no delay of theirs, and without a sample or a
// clock there is nothing to measure.
TEST(FrameTrace, CountsASampleOnceAndLeavesOutWhatIsNotKnown) {
  FrameTimes without_clock = frame(4, 500 * kMs);
  without_clock.received_ns = without_clock.decoded_ns = 0;
  const auto stages = stage_times({frame(1, 100 * kMs), frame(2, 100 * kMs), frame(3, 0), without_clock});
  EXPECT_EQ(stages[0].count, 2u);
  EXPECT_EQ(stages[1].count, 3u);
  EXPECT_EQ(stages[3].count, 1u);
  EXPECT_THAT(to_table(stage_times({})), testing::HasSubstr("nothing to measure"));
}

TEST(FrameTrace, IsALineForEachFrame) {
  TemporaryFolder folder;
  FrameTrace trace;
  trace.add(frame(7, 100 * kMs));
  ASSERT_TRUE(trace.save(folder.path() / "trace.csv"));
  EXPECT_EQ(load_text(folder.path() / "trace.csv", 1'000).value(),
            "tick,mode,sim_time_ns,motion_ns,sent_ns,received_ns,decoded_ns,clock_error_ns\n"
            "7,strands,0,100000000,110000000,117000000,119000000,0\n");
  EXPECT_EQ(to_csv(stage_times(trace.frames())).substr(0, 45),
            "stage,frames,median_ms,p90_ms,p99_ms,most_ms\n");
}

}  // namespace
}  // namespace strandcast

// Percentiles of the way of frames, and their CSV.
#include "client/app/frame_trace.h"

#include <gmock/gmock.h>

#include "common/base/file.h"
#include "common/base/units.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::frame_trace_test {
namespace {

FrameTimes frame(uint64_t tick, int64_t motion_ns) {
  FrameTimes times;
  times.tick = tick;
  times.motion_ns = motion_ns;
  times.sent_ns = motion_ns + 10 * kMsInNs;
  times.received_ns = times.sent_ns + static_cast<int64_t>(tick) * kMsInNs;
  times.decoded_ns = times.received_ns + 2 * kMsInNs;
  return times;
}

TEST(FrameTrace, SaysHowLongEachPartOfTheWayTakes) {
  std::vector<FrameTimes> frames;
  for (uint64_t tick = 1; tick <= 101; ++tick) {
    frames.push_back(frame(tick, static_cast<int64_t>(tick) * 100 * kMsInNs));
    frames.back().source_ns = frames.back().motion_ns - 1 * kMsInNs;
    frames.back().published_ns = frames.back().motion_ns + 7 * kMsInNs;
    frames.back().presented_ns = frames.back().decoded_ns + 5 * kMsInNs;
  }
  const auto stages = stage_times(frames);
  const auto stage = [&](const std::string& name) {
    for (const StageTimes& one : stages)
      if (one.stage == name) return one;
    ADD_FAILURE() << "there is no " << name;
    return StageTimes{};
  };
  EXPECT_DOUBLE_EQ(stage("motion made -> received").median_ms, 1.0);
  EXPECT_DOUBLE_EQ(stage("motion received -> simulated").median_ms, 7.0);
  EXPECT_DOUBLE_EQ(stage("simulated -> sent").median_ms, 3.0);
  EXPECT_DOUBLE_EQ(stage("motion received -> sent").median_ms, 10.0);
  EXPECT_EQ(stage("sent -> received").count, 101u);
  EXPECT_DOUBLE_EQ(stage("sent -> received").median_ms, 51.0);
  EXPECT_DOUBLE_EQ(stage("sent -> received").p90_ms, 91.0);
  EXPECT_DOUBLE_EQ(stage("sent -> received").most_ms, 101.0);
  EXPECT_DOUBLE_EQ(stage("received -> decoded").p99_ms, 2.0);
  EXPECT_DOUBLE_EQ(stage("motion received -> decoded").median_ms, 63.0);

  const std::vector<WayPart> way = way_parts(frames);
  ASSERT_EQ(way.size(), 5u);
  const double wanted_ms[] = {7.0, 3.0, 51.0, 2.0, 5.0};
  for (size_t i = 0; i < way.size(); ++i) EXPECT_DOUBLE_EQ(way[i].median_ms, wanted_ms[i]) << way[i].name;
  for (FrameTimes& one : frames) one.published_ns = one.presented_ns = 0;
  EXPECT_EQ(way_parts(frames).size(), 2u) << "what the server did not tell, and what nobody showed";
}

// A sample that stays in later states because no other comes is no delay of theirs, and without a sample or a
// clock there is nothing to measure.
TEST(FrameTrace, CountsASampleOnceAndLeavesOutWhatIsNotKnown) {
  FrameTimes without_clock = frame(4, 500 * kMsInNs);
  without_clock.received_ns = without_clock.decoded_ns = 0;
  const auto stages =
      stage_times({frame(1, 100 * kMsInNs), frame(2, 100 * kMsInNs), frame(3, 0), without_clock});
  ASSERT_EQ(stages.size(), 7u);
  EXPECT_EQ(stages[3].stage, "motion received -> sent");
  EXPECT_EQ(stages[3].count, 2u);
  EXPECT_EQ(stages[4].count, 3u);
  EXPECT_EQ(stages[6].count, 1u);
  EXPECT_THAT(to_table(stage_times({})), testing::HasSubstr("nothing to measure"));
}

constexpr const char* kColumns =
    "tick,mode,sim_time_ns,source_ns,motion_ns,published_ns,encoded_ns,sent_ns,received_ns,decoded_ns,"
    "presented_ns,clock_error_ns\n";

TEST(FrameTrace, IsALineForEachFrameWithWhatTheServerTellsLater) {
  TemporaryFolder folder;
  FrameTrace trace(2);
  ASSERT_TRUE(trace.open(folder.path() / "trace.csv"));
  for (uint64_t tick = 7; tick <= 9; ++tick) {
    FrameTimes times = frame(tick, tick == 8 ? 0 : 100 * kMsInNs);  // as of a picture
    times.sim_time_ns = static_cast<int64_t>(tick) * 10 * kMsInNs;
    times.mode = tick == 8 ? StreamMode::Frames : StreamMode::Strands;
    trace.add(times);
  }
  trace.note_states(std::vector<StateTime>{{7, 70 * kMsInNs, 1, 2, 3, 4}, {8, 80 * kMsInNs, 11, 12, 13, 14}});
  trace.note_presented(StreamMode::Strands, 95 * kMsInNs, 777);  // between the last state and one to come
  trace.note_presented(StreamMode::Strands, 96 * kMsInNs, 778);
  trace.note_presented(StreamMode::Frames, 80 * kMsInNs + kShownStateNs, 779);  // of a state that never came
  ASSERT_TRUE(trace.close());
  EXPECT_EQ(load_text(folder.path() / "trace.csv", 2'000).value(),
            fmt::format("{}"
                        "7,strands,70000000,0,100000000,0,0,110000000,117000000,119000000,0,0\n"
                        "8,frames,80000000,11,12,13,14,10000000,18000000,20000000,0,0\n"
                        "9,strands,90000000,0,100000000,0,0,110000000,119000000,121000000,777,0\n",
                        kColumns))
      << "the first had gone when the server told of it";
  EXPECT_FALSE(FrameTrace().open(folder.path() / "no" / "such"));
  EXPECT_EQ(to_csv(stage_times({})).substr(0, 45), "stage,frames,median_ms,p90_ms,p99_ms,most_ms\n");
}

// Ticks begin again with a new server: nothing of it is of frames before.
TEST(FrameTrace, LeavesFramesOfEarlierSessionsAlone) {
  FrameTrace trace;
  FrameTimes times = frame(7, 0);
  times.sim_time_ns = 70 * kMsInNs;
  trace.add(times);
  trace.begin_session();
  trace.note_states(std::vector<StateTime>{{7, 70 * kMsInNs, 1, 2, 3, 4}});
  trace.note_presented(StreamMode::Strands, 70 * kMsInNs, 5);
  ASSERT_EQ(trace.frames().size(), 1u);
  EXPECT_EQ(trace.frames()[0].published_ns, 0);
  EXPECT_EQ(trace.frames()[0].presented_ns, 0);
  trace.add(times);
  trace.note_states(std::vector<StateTime>{{7, 70 * kMsInNs, INT64_MIN, INT64_MAX, 3, 4}});
  EXPECT_EQ(trace.frames()[1].published_ns, 3);
  EXPECT_EQ(trace.frames()[1].source_ns, 0) << "no time of any clock";
  EXPECT_EQ(trace.decoded_since(times.decoded_ns).size(), 2u);
  EXPECT_TRUE(trace.decoded_since(times.decoded_ns + 1).empty());
}

}  // namespace
}  // namespace strandcast::frame_trace_test

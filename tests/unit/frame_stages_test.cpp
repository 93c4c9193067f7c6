// When states were where in the server: histograms, and the trace.
#include "server/app/frame_stages.h"
#include "common/base/units.h"

#include <gmock/gmock.h>

#include "common/base/file.h"
#include "server/app/process_metrics.h"
#include "server/net/roles.h"
#include "tests/support/metrics_text.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::frame_stages_test {
namespace {

SnapshotInfo state(uint64_t tick, int64_t motion_ns) {
  SnapshotInfo info;
  info.tick = tick;
  info.sim_time_ns = static_cast<int64_t>(tick) * 16 * kMsInNs;
  info.motion_time_ns = motion_ns;
  return info;
}

TEST(FrameStages, TracesEachStateOnce) {
  TemporaryFolder folder;
  {
    FrameStages stages;
    stages.set_source_times([](int64_t arrival_ns) { return arrival_ns - 2; });
    ASSERT_TRUE(stages.open_trace(folder.path() / "trace.csv"));
    stages.note_state(state(1, 5), 10);
    stages.note_state(state(1, 5), 11);  // published once more
    stages.note_encoded(16 * kMsInNs, 20);
    stages.note_encoded(16 * kMsInNs, 25);  // for another class
    stages.note_state(state(2, 5), 30);
    stages.note_encoded(99, 31);  // of no state that is known
  }
  EXPECT_EQ(load_text(folder.path() / "trace.csv", 1'000).value(),
            "tick,sim_time_ns,source_ns,motion_ns,published_ns,encoded_ns\n1,16000000,3,5,10,20\n2,32000000,"
            "3,5,30,0\n");
  FrameStages nowhere;
  EXPECT_FALSE(nowhere.open_trace(folder.path() / "no" / "such"));
}

// Once each, when all is known of it that will be.
TEST(FrameStages, TellsStatesThatAreThroughOnce) {
  FrameStages stages;
  const auto ticks = [&](int64_t time_ns) {
    std::vector<uint64_t> all;
    for (const StateTime& taken : stages.take_states(time_ns)) all.push_back(taken.tick);
    return all;
  };
  stages.note_state(state(1, 5), 10);
  stages.note_state(state(2, 6), 20);
  stages.note_state(state(3, 0), 30);
  EXPECT_THAT(ticks(40), testing::IsEmpty()) << "their frames may still come";
  stages.note_encoded(16 * kMsInNs, 45);
  const std::vector<StateTime> first = stages.take_states(50);
  ASSERT_EQ(first.size(), 1u);
  EXPECT_EQ(first[0], (StateTime{1, 16 * kMsInNs, 0, 5, 10, 45}));
  EXPECT_THAT(ticks(60), testing::IsEmpty());
  stages.note_encoded(48 * kMsInNs, 65);
  EXPECT_THAT(ticks(70), testing::IsEmpty()) << "in their order";
  EXPECT_THAT(ticks(20 + kFramePatienceNs), testing::ElementsAre(2, 3)) << "no frame comes of the second";
  stages.note_state(state(4, 0), 100);
  EXPECT_THAT(ticks(101 + kToldStateNs), testing::IsEmpty()) << "nobody asks for that any more";
}

TEST(FrameStages, HistogramsCountASampleOnce) {
  FrameStages stages;
  for (uint64_t tick = 1; tick <= 200; ++tick) {
    stages.note_state(state(tick, tick < 100 ? 1 * kMsInNs : 2 * kMsInNs), 8 * kMsInNs);
    stages.note_encoded(static_cast<int64_t>(tick) * 16 * kMsInNs, 11 * kMsInNs);
  }
  std::vector<std::string> faults;
  const auto families = test::read_metrics(stages.metrics(), faults);
  EXPECT_THAT(faults, testing::IsEmpty());
  const auto value = [&](const std::string& family, const std::string& name) {
    for (const auto& [sample, number] : families.at(family).samples)
      if (sample == name) return number;
    return -1.0;
  };
  EXPECT_EQ(value("strandcast_motion_to_state_ms", "strandcast_motion_to_state_ms_count"), 2.0);
  EXPECT_EQ(value("strandcast_motion_to_state_ms", "strandcast_motion_to_state_ms_sum"), 13.0);
  EXPECT_EQ(value("strandcast_state_to_frame_ms", "strandcast_state_to_frame_ms_count"), 200.0);
  EXPECT_EQ(value("strandcast_state_to_frame_ms", "strandcast_state_to_frame_ms_bucket{le=\"4\"}"), 200.0);
}

TEST(ProcessMetrics, SayWhatTheProcessTakes) {
  std::vector<std::string> faults;
  const auto families = test::read_metrics(format_process_metrics(), faults);
  EXPECT_THAT(faults, testing::IsEmpty());
  for (const char* name :
       {"process_cpu_seconds_total", "process_threads", "process_resident_memory_bytes",
        "process_start_time_seconds", "process_open_fds", "process_virtual_memory_bytes"}) {
    ASSERT_TRUE(families.contains(name)) << name;
    EXPECT_GT(families.at(name).samples.at(0).second, 0.0) << name;
  }
  EXPECT_LT(families.at("process_resident_memory_bytes").samples[0].second,
            families.at("process_virtual_memory_bytes").samples[0].second);
  const double now_s = static_cast<double>(unix_time_s());
  EXPECT_NEAR(families.at("process_start_time_seconds").samples[0].second, now_s, 3'600.0);
}

}  // namespace
}  // namespace strandcast::frame_stages_test

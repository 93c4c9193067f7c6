// FrameStages: when each state was where on its way through the server: its newest motion sample received,
// the state simulated and published, its first strand frame encoded. Histograms for /metrics, and a trace as
// CSV where one is asked for, keyed by tick like that of viewers. Bounded. Any thread.
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "common/base/histogram.h"
#include "common/base/result.h"
#include "common/strands/snapshot.h"
#include "common/wire/messages.h"
#include "server/stream/state_source.h"

namespace strandcast {

/// States whose frame may still come, or that were not told yet.
inline constexpr size_t kMaxOpenStates = kMaxStateTimes;
/// A state whose frame has not come after so long is told without it; one that is older is told no more.
inline constexpr int64_t kFramePatienceNs = 250'000'000;
inline constexpr int64_t kToldStateNs = 2'000'000'000;
inline constexpr uint64_t kMaxTraceLines = 10'000'000;

class FrameStages {
 public:
  FrameStages() = default;
  /// Writes what is left of the trace.
  ~FrameStages();
  FrameStages(const FrameStages&) = delete;
  FrameStages& operator=(const FrameStages&) = delete;

  /// From now on each state is a line of this file. Before the first state.
  Status open_trace(const std::filesystem::path& path);

  /// When the motion sample of a state was made, by its arrival; 0 = not known. Before the first state.
  void set_source_times(std::function<int64_t(int64_t arrival_ns)> times) {
    source_times_ = std::move(times);
  }

  void note_state(const SnapshotInfo& state, int64_t time_ns);
  /// Of the state of this simulation time; the first frame of it counts.
  void note_encoded(int64_t sim_time_ns, int64_t time_ns);

  /// Those that were not taken yet, oldest first: all that is known of them.
  std::vector<StateTime> take_states(int64_t time_ns);

  /// Lines for /metrics.
  std::string metrics() const;

 private:
  struct Row {
    StateTime times;
    bool is_taken = false;
  };
  void close_row();

  std::function<int64_t(int64_t)> source_times_;
  mutable std::mutex mutex_;
  std::deque<Row> open_;  // oldest first
  int64_t last_motion_ns_ = 0;
  Histogram motion_to_state_;
  Histogram state_to_frame_;
  std::ofstream trace_;
  uint64_t trace_lines_ = 0;
};

/// Notes states on their way from a source to the hub.
class StageSink : public StateSink {
 public:
  StageSink(StateSink& next, FrameStages& stages) : next_(next), stages_(stages) {}
  void put(std::shared_ptr<const Snapshot> state) override;
  void change_stream(const StreamDesc& stream) override { next_.change_stream(stream); }
  void change_look(const LookChange& look) override { next_.change_look(look); }
  void change_shape(std::shared_ptr<const SceneAsset> asset) override {
    next_.change_shape(std::move(asset));
  }

 private:
  StateSink& next_;
  FrameStages& stages_;
};

}  // namespace strandcast

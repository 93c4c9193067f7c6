// FrameStages: records when each state passed the stages of the server: arrival of its newest motion sample,
// simulation, publication, encoding of its first strand frame. Provides histograms for /metrics and, on
// request, a CSV trace keyed by tick like that of viewers. Bounded memory. Any thread.
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <fstream>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "common/base/histogram.h"
#include "common/base/result.h"
#include "common/strands/snapshot.h"
#include "common/wire/messages.h"

namespace strandcast {

/// Largest number of states whose times are incomplete or were not taken yet.
inline constexpr size_t kMaxOpenStates = kMaxStateTimes;
/// A state that was not encoded within the first time is reported without its frame; a state older than the
/// second is dropped.
inline constexpr int64_t kFramePatienceNs = 250'000'000;
inline constexpr int64_t kToldStateNs = 2'000'000'000;
inline constexpr uint64_t kMaxTraceLines = 10'000'000;

class FrameStages {
 public:
  FrameStages() = default;
  /// Writes the remaining lines of the trace.
  ~FrameStages();
  FrameStages(const FrameStages&) = delete;
  FrameStages& operator=(const FrameStages&) = delete;

  /// Writes a line per state to this file from now on; call it before the first state.
  Status open_trace(const std::filesystem::path& path);

  /// Sets the function that maps the arrival time of a motion sample to the time when the sample was made; 0
  /// = not known. Call it before the first state.
  void set_source_times(std::function<int64_t(int64_t arrival_ns)> times) {
    source_times_ = std::move(times);
  }

  void note_state(const SnapshotInfo& state, int64_t time_ns);
  /// Notes that the state of this simulation time was encoded; only its first frame counts.
  void note_encoded(int64_t sim_time_ns, int64_t time_ns);

  /// Returns the times of the states that were not taken yet, oldest first.
  std::vector<StateTime> take_states(int64_t time_ns);

  /// Returns the lines for /metrics.
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

}  // namespace strandcast

// Replay: simulates a recording's scene again with the recorded inputs and changes, and compares the hash of
// every state. The simulation has no readers and follows no clock.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server/source/simulation_source.h"

namespace strandcast {

enum class ReplayPace { AsFastAsItGoes, RealTime };

struct ReplayProgress {
  uint64_t compared = 0;
  uint64_t recorded = 0;  // states in the file
  uint64_t tick = 0;
};

struct ReplayConfig {
  std::filesystem::path recording;
  ExecutorConfig device;  // sim_device "auto": what the recording was made on
  ReplayPace pace = ReplayPace::AsFastAsItGoes;
  std::function<void(const ReplayProgress&)> on_progress = {};  // now and then, on a thread of the replay
  std::function<void(const std::string&)> on_note = {};         // what a person should know; likewise
  const std::atomic<bool>* stop = nullptr;                      // set: it ends
};

/// The first state that differs from the recording.
struct ReplayDifference {
  uint64_t tick = 0;
  std::string what;  // a sentence without its end
};

struct ReplayResult {
  uint64_t compared = 0;  // states
  uint64_t equal = 0;
  double seconds = 0.0;  // that it took
  std::optional<ReplayDifference> difference;
  std::string early_end;  // why it did not come to the end of the recording; empty = it did

  bool is_equal() const { return compared > 0 && equal == compared && !difference && early_end.empty(); }
};

/// Replays a recording. NotFound, BadInput or Unsupported if the recording, its scene or its groom is
/// unavailable, or if recording did not begin with the simulation.
Result<ReplayResult> replay_recording(const ReplayConfig& config);

/// Describes the result: "3600 of 3600 state hashes are equal", or where they first differ.
std::string to_sentence(const ReplayResult& result);

}  // namespace strandcast

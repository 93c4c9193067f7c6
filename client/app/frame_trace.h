// FrameTrace: when each frame was where on its way, as this viewer sees it: of the server's times what frames
// carry, of its own when they were received and decoded, all on the server's clock. Bounded. One thread.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/wire/messages.h"

namespace strandcast {

/// Of one frame; server clock, ns; 0 = not known.
struct FrameTimes {
  StreamMode mode = StreamMode::Strands;
  uint64_t tick = 0;
  int64_t sim_time_ns = 0;  // simulation time
  int64_t motion_ns = 0;    // arrival of the newest motion sample in it, at the server
  int64_t sent_ns = 0;      // handed to the network
  int64_t received_ns = 0;  // by this viewer
  int64_t decoded_ns = 0;
  int64_t clock_error_ns = 0;  // of the two times before, at most
};

inline constexpr size_t kMaxTracedFrames = 1'000'000;

class FrameTrace {
 public:
  /// Frames beyond kMaxTracedFrames are counted and left out.
  void add(const FrameTimes& times);
  const std::vector<FrameTimes>& frames() const { return frames_; }
  uint64_t left_out() const { return left_out_; }

  /// One line per frame under a line of names.
  Status save(const std::filesystem::path& path) const;

 private:
  std::vector<FrameTimes> frames_;
  uint64_t left_out_ = 0;
};

/// How long one part of the way takes, ms.
struct StageTimes {
  std::string stage;
  size_t count = 0;
  double median_ms = 0.0, p90_ms = 0.0, p99_ms = 0.0, most_ms = 0.0;
};

/// Of the parts of the way, and of all of it.
std::vector<StageTimes> stage_times(const std::vector<FrameTimes>& frames);

/// A table for people, and lines of comma-separated values.
std::string to_table(const std::vector<StageTimes>& stages);
std::string to_csv(const std::vector<StageTimes>& stages);

}  // namespace strandcast

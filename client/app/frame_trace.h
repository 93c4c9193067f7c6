// FrameTrace: records when each frame passed each stage up to this viewer. Server times come with frames and,
// on request, with state times; the viewer adds reception, decoding and presentation. All on the server's
// clock. An optional file gets a line per frame, keyed by tick like the server's own trace. Bounded. Any
// thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/wire/messages.h"

namespace strandcast {

/// Times of one frame; server clock, ns; 0 = not known or not reached.
struct FrameTimes {
  StreamMode mode = StreamMode::Strands;
  uint64_t tick = 0;
  int64_t sim_time_ns = 0;     // simulation time
  int64_t source_ns = 0;       // the newest motion sample in it was made
  int64_t motion_ns = 0;       // and arrived at the server
  int64_t published_ns = 0;    // simulated
  int64_t encoded_ns = 0;      // its state's first frame of strands
  int64_t sent_ns = 0;         // handed to the network
  int64_t received_ns = 0;     // by this viewer
  int64_t decoded_ns = 0;      // ready to be drawn, or to be shown
  int64_t presented_ns = 0;    // a picture of it was there; of several the first
  int64_t clock_error_ns = 0;  // of the three times before, at most
};

inline constexpr size_t kMaxTracedFrames = 1'000'000;
/// Number of frames that a user of recent values keeps: some seconds of any stream.
inline constexpr size_t kRecentFrames = 2'048;
inline constexpr uint64_t kMaxFrameLines = 10'000'000;
/// Greatest age of a state relative to the moment that a picture shows; the picture is attributed to the
/// newest state up to that moment.
inline constexpr int64_t kShownStateNs = 250'000'000;

class FrameTrace {
 public:
  /// Keeps the newest `kept_frames` frames; older ones are dropped, or written to the file if there is one.
  explicit FrameTrace(size_t kept_frames = kMaxTracedFrames) : kept_frames_(kept_frames) {}
  /// Closes the file like close(), but ignores errors.
  ~FrameTrace();
  FrameTrace(const FrameTrace&) = delete;
  FrameTrace& operator=(const FrameTrace&) = delete;

  /// Writes each frame as a line of this file, once its times are complete.
  Status open(const std::filesystem::path& path);
  /// Writes the remaining frames and closes the file.
  Status close();

  /// Sets whether the server is asked for the times of its states.
  void want_states(bool is_wanted) { wants_states_ = is_wanted; }
  bool wants_states() const { return wants_states_; }

  /// Begins a new connection: ticks may restart, and later times belong to none of the earlier frames.
  void begin_session();
  void add(const FrameTimes& times);
  void note_states(std::span<const StateTime> states);
  /// Notes that a picture of this simulated moment was shown at `time_ns`, drawn from strands or received
  /// from the server.
  void note_presented(StreamMode mode, int64_t sim_time_ns, int64_t time_ns);

  /// Returns the kept frames, oldest first.
  std::vector<FrameTimes> frames() const;
  /// Returns the kept frames that were decoded since `time_ns`.
  std::vector<FrameTimes> decoded_since(int64_t time_ns) const;

 private:
  void write(const FrameTimes& frame);

  const size_t kept_frames_;
  std::atomic<bool> wants_states_{false};
  mutable std::mutex mutex_;  // guards all below
  std::deque<FrameTimes> frames_;
  size_t session_frames_ = 0;  // the newest of frames_, of this connection
  std::ofstream file_;
  uint64_t line_count_ = 0;
};

/// Duration of one stage over many frames, ms.
struct StageTimes {
  std::string stage;
  size_t count = 0;
  double median_ms = 0.0, p90_ms = 0.0, p99_ms = 0.0, most_ms = 0.0;
};

/// Returns the durations of all stages, and of the whole way.
std::vector<StageTimes> stage_times(const std::vector<FrameTimes>& frames);

/// Formats a table for people, and comma-separated values.
std::string to_table(const std::vector<StageTimes>& stages);
std::string to_csv(const std::vector<StageTimes>& stages);

/// One stage on the way from a motion sample to the picture that shows it, for a person.
struct WayPart {
  const char* name;
  double median_ms = 0.0;
};
/// Returns the measured stages in order.
std::vector<WayPart> way_parts(const std::vector<FrameTimes>& frames);

}  // namespace strandcast

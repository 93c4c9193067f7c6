// FrameTrace: when each frame was where on its way, as this viewer sees it: of the server's times what frames
// carry and, where they were asked for, what it tells of its states; of its own when they were received,
// decoded and presented; all on the server's clock. A file gets a line for each, by the same ticks as the
// server's own trace. Bounded. Any thread.
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

/// Of one frame; server clock, ns; 0 = not known, or it never was there.
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
/// For who only looks at what was just now: seconds of any stream.
inline constexpr size_t kRecentFrames = 2'048;
inline constexpr uint64_t kMaxFrameLines = 10'000'000;
/// A picture is of the newest state that is no later than the moment it shows, and no older than this.
inline constexpr int64_t kShownStateNs = 250'000'000;

class FrameTrace {
 public:
  /// So many frames stay; the oldest go, into the file where there is one.
  explicit FrameTrace(size_t kept_frames = kMaxTracedFrames) : kept_frames_(kept_frames) {}
  /// As close(), whose error nobody hears.
  ~FrameTrace();
  FrameTrace(const FrameTrace&) = delete;
  FrameTrace& operator=(const FrameTrace&) = delete;

  /// From now on each frame is a line of this file, once nothing more is to be known of it.
  Status open(const std::filesystem::path& path);
  /// Writes those that are left.
  Status close();

  /// Whether the server is to tell when its states were simulated and encoded.
  void want_states(bool is_wanted) { wants_states_ = is_wanted; }
  bool wants_states() const { return wants_states_; }

  /// A new connection: ticks may begin again, and what comes is of no frame before.
  void begin_session();
  void add(const FrameTimes& times);
  void note_states(std::span<const StateTime> states);
  /// A picture of this moment, drawn of strands or of the server, was there at `time_ns`.
  void note_presented(StreamMode mode, int64_t sim_time_ns, int64_t time_ns);

  /// Those that are kept, oldest first.
  std::vector<FrameTimes> frames() const;
  /// Of these, those that were decoded since then.
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

/// One part of the way from a motion sample to the picture that shows it, for a person.
struct WayPart {
  const char* name;
  double median_ms = 0.0;
};
/// Those that were measured, in their order.
std::vector<WayPart> way_parts(const std::vector<FrameTimes>& frames);

}  // namespace strandcast

// StrandReplay: turns received strand frames into strands to draw. Decodes, keeps the newest snapshots,
// interpolates between them, asks for keyframes and measures. A viewer never simulates: between snapshots it
// only interpolates. One thread; no network, no GL.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "common/base/profile.h"
#include "common/base/result.h"
#include "common/replay/clock_offset.h"
#include "common/replay/playout_clock.h"
#include "common/replay/state_blend.h"
#include "common/strands/posed_strands.h"
#include "common/strands/snapshot.h"
#include "common/strands/strand_codec.h"

namespace strandcast {

enum class Playout {
  LowLatency,  // the newest snapshot as it is: the same state the server would draw
  Smooth,      // interpolated between snapshots, behind by an adaptive delay
};

/// Whether a state belongs to the same stream as the preceding ones.
enum class Continuity { SameStream, OtherStream };

/// Number of states kept. Smooth playout at 60 Hz lags at most 100 ms, and twice that after a burst.
inline constexpr size_t kKeptSnapshots = 16;
/// Memory limit of kept states. At least the two that a picture lies between are kept; they allow linear
/// interpolation only.
inline constexpr uint64_t kMaxKeptSnapshotBytes = 256ull << 20;
/// Greatest age, relative to the newest state, of a state that a keyframe of another stream may repeat.
inline constexpr int64_t kStreamOverlapNs = 1'000'000'000;

class SnapshotTimeline {
 public:
  explicit SnapshotTimeline(uint64_t limit_bytes = kMaxKeptSnapshotBytes) : limit_bytes_(limit_bytes) {}
  void set_playout(Playout playout) { playout_ = playout; }
  Playout playout() const { return playout_; }

  /// Adds a state received at `receive_time_ns` on the client's clock.
  void add(std::shared_ptr<const Snapshot> snapshot, int64_t receive_time_ns, Continuity continuity);

  /// Returns the newest state; null before the first.
  std::shared_ptr<const Snapshot> newest() const;
  const std::deque<std::shared_ptr<const Snapshot>>& snapshots() const { return snapshots_; }
  const PlayoutClock& clock() const { return clock_; }
  /// Returns how often time has run backwards because the server was reset.
  uint64_t restarts() const { return restarts_; }

 private:
  uint64_t limit_bytes_;
  Playout playout_ = Playout::LowLatency;
  PlayoutClock clock_;
  std::deque<std::shared_ptr<const Snapshot>> snapshots_;  // oldest first
  uint64_t restarts_ = 0;
};

/// Plays successive copies of a timeline without jumping back. The interpolation chosen between two states
/// stays until the later one is reached, so that a change is never visible. One thread.
class TimelinePlayer {
 public:
  /// Sets the fill for states without all strands, made from the asset's rest shape.
  void set_fill(StrandFill fill) { blend_.set_fill(std::move(fill)); }
  /// Returns the strands to draw at client time `client_time_ns`; empty while the timeline is empty.
  std::optional<PosedStrands> strands_at(const SnapshotTimeline& timeline, int64_t client_time_ns);
  /// Interpolation of the newest strands, and their simulated time.
  Interpolation interpolation() const { return interpolation_; }
  int64_t sim_time_ns() const { return sim_time_ns_; }

 private:
  StateBlend blend_;
  PlayoutCursor cursor_;
  uint64_t restarts_ = 0;
  Interpolation interpolation_ = Interpolation::None;
  int64_t sim_time_ns_ = 0;
};

struct ReplayStats {
  uint64_t decoded_frames = 0;
  uint64_t keyframes = 0;
  uint64_t exact_frames = 0;  // without corrections
  uint64_t received_frames = 0;
  uint64_t received_bytes = 0;
  uint64_t rejected_frames = 0;  // malformed, or their base was missing
  uint64_t wrong_states = 0;     // of those: keyframes, and deltas whose base was there
  uint64_t gaps = 0;             // places where the sequence jumped
  uint64_t missed_frames = 0;    // frames the server numbered and this client never saw
  uint64_t keyframe_requests = 0;
  std::string last_error;  // of the newest rejected frame
};

/// Asks the server for a keyframe; called at most once per kKeyframeRequestInterval.
using KeyframeRequester = std::function<void()>;

class StrandReplay {
 public:
  /// Makes a replay for a stream as its Welcome announces it. NotFound or BadInput if this program cannot
  /// decode it.
  static Result<std::unique_ptr<StrandReplay>> make(const std::string& codec,
                                                    const StrandStreamLimits& limits,
                                                    KeyframeRequester request_keyframe);

  /// Decodes one strand frame (header and payload), received at `receive_time_ns` on the client's clock.
  /// Returns null for a frame that cannot be used, counts it and asks for a keyframe. `clock` may have no
  /// value yet.
  std::shared_ptr<const Snapshot> receive(std::span<const std::byte> message, int64_t receive_time_ns,
                                          const ClockOffset& clock);

  /// Accepts the next keyframe with any sequence number, because other frames were sent instead for a while.
  void forget_sequence() { last_sequence_ = 0; }

  /// Changes to another codec: from the first keyframe of a new stream on, or at once if nothing was decoded
  /// yet. `rest_in_head_m` as for set_rest_shape(); empty before the asset came. NotFound if this program
  /// cannot decode it; then nothing changes.
  Status follow_codec(const std::string& codec, std::span<const glm::vec3> rest_in_head_m);

  /// Sets the asset's rest shape; call it before the first strand frame.
  void set_rest_shape(std::span<const glm::vec3> rest_in_head_m);

  void set_playout(Playout playout) { timeline_.set_playout(playout); }
  Playout playout() const { return timeline_.playout(); }

  /// Returns the newest snapshot; null before the first keyframe.
  std::shared_ptr<const Snapshot> newest() const { return timeline_.newest(); }
  /// Returns the newest states, which a drawing thread may copy.
  const SnapshotTimeline& timeline() const { return timeline_; }
  /// Returns the strands to draw at client time `client_time_ns`; empty before the first keyframe.
  std::optional<PosedStrands> strands_at(int64_t client_time_ns) {
    return player_.strands_at(timeline_, client_time_ns);
  }
  /// Returns the time since the server sent the newest decoded frame, ms; 0 without a clock estimate.
  double state_age_ms(int64_t client_time_ns, const ClockOffset& clock) const;

  /// Returns the stream of the newest decoded state; each stream numbers its frames itself.
  uint16_t stream_id() const { return stream_id_; }
  /// Returns the number of the newest frame in its stream. A state that is encoded twice has two.
  uint32_t sequence() const { return last_sequence_; }
  const ReplayStats& stats() const { return stats_; }
  const StageTimer& decode_timer() const { return decode_timer_; }
  /// Times from the arrival of a motion sample at the server to the decoded state that contains it, ms.
  const StageTimer& motion_latency_timer() const { return motion_latency_timer_; }
  /// Returns the delay of smooth playout, ms.
  double playout_delay_ms() const { return static_cast<double>(timeline_.clock().delay_ns()) * 1e-6; }

 private:
  /// A decoder and the name of its codec.
  struct Decoding {
    std::string codec;
    std::unique_ptr<StrandDecoder> decoder;
  };

  StrandReplay(Decoding decoding, const StrandStreamLimits& limits, KeyframeRequester request_keyframe);
  void begin_next();
  void reject(const Error& error, int64_t receive_time_ns);
  void note_sequence(const FrameHeader& header);
  Status check_stream(const FrameHeader& header) const;

  Decoding now_;
  std::optional<Decoding> next_;  // announced, and not begun
  const uint32_t strand_count_;
  const uint32_t vertex_count_;
  KeyframeRequester request_keyframe_;
  SnapshotTimeline timeline_;
  TimelinePlayer player_;
  ReplayStats stats_;
  StageTimer decode_timer_;
  StageTimer motion_latency_timer_;
  uint16_t stream_id_ = 0;  // of the newest keyframe
  uint32_t last_sequence_ = 0;
  uint32_t decoded_sequence_ = 0;  // of this stream; 0 = none yet
  int64_t last_motion_time_ns_ = 0;
  int64_t newest_send_time_ns_ = 0;
  std::optional<int64_t> last_keyframe_request_ns_;
};

inline constexpr int64_t kReplayKeyframeRequestNs = 1'000'000'000;
}  // namespace strandcast

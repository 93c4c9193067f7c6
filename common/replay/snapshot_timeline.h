// SnapshotTimeline: the newest decoded states and the clock that chooses the moment to show. Copies are
// cheap, because states are shared and immutable: the receiving thread owns one, a drawing thread works on a
// copy. Pure logic.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <utility>

#include "common/replay/playout_clock.h"
#include "common/replay/state_blend.h"
#include "common/strands/posed_strands.h"
#include "common/strands/snapshot.h"

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

}  // namespace strandcast

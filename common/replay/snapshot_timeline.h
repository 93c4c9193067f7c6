// SnapshotTimeline: the newest decoded states and the clock that says which moment to show. Copies are cheap,
// because states are shared and never change: the receiving thread keeps one, a drawing thread works on a
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

/// Whether a state comes from the stream of the ones before.
enum class Continuity { SameStream, OtherStream };

/// Smooth playout at 60 Hz is at most 100 ms behind, and as much again after a burst.
inline constexpr size_t kKeptSnapshots = 16;
/// Of huge states only as many are kept as fit, but the two that a picture lies between: the line is then
/// what is drawn.
inline constexpr uint64_t kMaxKeptSnapshotBytes = 256ull << 20;
/// A keyframe of another stream may repeat a state this much older than the newest one.
inline constexpr int64_t kStreamOverlapNs = 1'000'000'000;

class SnapshotTimeline {
 public:
  explicit SnapshotTimeline(uint64_t limit_bytes = kMaxKeptSnapshotBytes) : limit_bytes_(limit_bytes) {}
  void set_playout(Playout playout) { playout_ = playout; }
  Playout playout() const { return playout_; }

  /// A state received at `receive_time_ns` on the client's clock.
  void add(std::shared_ptr<const Snapshot> snapshot, int64_t receive_time_ns, Continuity continuity);

  /// Null before the first.
  std::shared_ptr<const Snapshot> newest() const;
  const std::deque<std::shared_ptr<const Snapshot>>& snapshots() const { return snapshots_; }
  const PlayoutClock& clock() const { return clock_; }
  /// How often time has run backwards: the server was reset.
  uint64_t restarts() const { return restarts_; }

 private:
  uint64_t limit_bytes_;
  Playout playout_ = Playout::LowLatency;
  PlayoutClock clock_;
  std::deque<std::shared_ptr<const Snapshot>> snapshots_;  // oldest first
  uint64_t restarts_ = 0;
};

/// Walks through timelines, each newer than the last, without jumping back. What it chose between two states
/// stays until the later one is reached, so that a change of it is never seen. One thread.
class TimelinePlayer {
 public:
  /// For states without all strands, made from the asset's rest shape.
  void set_fill(StrandFill fill) { blend_.set_fill(std::move(fill)); }
  /// What to draw at client time `client_time_ns`; nothing while the timeline is empty.
  std::optional<PosedStrands> strands_at(const SnapshotTimeline& timeline, int64_t client_time_ns);
  /// How the newest strands were made, and the simulated moment that they are of.
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

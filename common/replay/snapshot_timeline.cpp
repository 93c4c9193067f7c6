#include "common/replay/snapshot_timeline.h"

#include <algorithm>
#include <utility>

namespace strandcast {

namespace {

uint64_t bytes_of(const Snapshot& snapshot) {
  return snapshot.lattice.size() * sizeof(int32_t);
}
uint64_t bytes_of(const std::deque<std::shared_ptr<const Snapshot>>& snapshots) {
  uint64_t bytes = 0;
  for (const auto& snapshot : snapshots) bytes += bytes_of(*snapshot);
  return bytes;
}

}  // namespace

void SnapshotTimeline::add(std::shared_ptr<const Snapshot> snapshot, int64_t receive_time_ns,
                           Continuity continuity) {
  // A keyframe on request repeats the state that is already here.
  if (!snapshots_.empty() && snapshot->sim_time_ns == snapshots_.back()->sim_time_ns) {
    snapshots_.back() = std::move(snapshot);
    return;
  }
  // The first keyframe of another stream may be of a state that the old stream has passed: what is shown
  // stays.
  if (continuity == Continuity::OtherStream && !snapshots_.empty()) {
    const int64_t behind_ns = snapshots_.back()->sim_time_ns - snapshot->sim_time_ns;
    if (behind_ns > 0 && behind_ns < kStreamOverlapNs) return;
  }
  // Waiting for a fourth state is no use where there is no room for four.
  clock_.limit_frames_behind(KnotTimes{}.size() * bytes_of(*snapshot) <= limit_bytes_ ? 2 : 1);
  clock_.add(receive_time_ns, snapshot->sim_time_ns);
  // A reset server starts at zero again: blending across it would sweep the hair through the head.
  const bool goes_back = !snapshots_.empty() && snapshot->sim_time_ns < snapshots_.back()->sim_time_ns;
  if (goes_back) {
    snapshots_.clear();
    ++restarts_;
  }
  snapshots_.push_back(std::move(snapshot));
  const size_t kept = playout_ == Playout::Smooth ? kKeptSnapshots : 1;
  while (snapshots_.size() > kept || (snapshots_.size() > 2 && bytes_of(snapshots_) > limit_bytes_))
    snapshots_.pop_front();
}

std::shared_ptr<const Snapshot> SnapshotTimeline::newest() const {
  return snapshots_.empty() ? nullptr : snapshots_.back();
}

std::optional<PosedStrands> TimelinePlayer::strands_at(const SnapshotTimeline& timeline,
                                                       int64_t client_time_ns) {
  const auto& snapshots = timeline.snapshots();
  interpolation_ = Interpolation::None;
  if (std::exchange(restarts_, timeline.restarts()) != timeline.restarts()) cursor_ = {};
  if (snapshots.empty()) return std::nullopt;
  sim_time_ns_ = snapshots.back()->sim_time_ns;
  if (timeline.playout() == Playout::LowLatency || snapshots.size() < 2 || !timeline.clock().has_value()) {
    blend_.leave();
    return blend_.at(*snapshots.back());
  }

  // While nothing new comes, time rests on the newest state; what then arrives late is caught up from there.
  const int64_t wanted_ns =
      std::min(timeline.clock().sim_time_at(client_time_ns), snapshots.back()->sim_time_ns);
  const int64_t sim_time_ns = cursor_.advance(client_time_ns, wanted_ns);
  const auto later = std::find_if(snapshots.begin(), snapshots.end(), [sim_time_ns](const auto& snapshot) {
    return snapshot->sim_time_ns > sim_time_ns;
  });
  if (later == snapshots.end()) return blend_.at(*snapshots.back());
  sim_time_ns_ = later == snapshots.begin() ? (*later)->sim_time_ns : sim_time_ns;
  if (later == snapshots.begin()) return blend_.at(**later);
  PosedStrands strands =
      blend_.between(snapshots, static_cast<size_t>(later - snapshots.begin()), sim_time_ns);
  interpolation_ = blend_.interpolation();
  return strands;
}

}  // namespace strandcast

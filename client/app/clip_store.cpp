#include "client/app/clip_store.h"

#include <algorithm>
#include <cmath>

namespace strandcast {

ClipSampler::ClipSampler(double pictures_per_s, double duration_s)
    : period_ns_(1e9 / pictures_per_s),
      wanted_(static_cast<size_t>(std::max(1.0, std::round(pictures_per_s * duration_s)))) {}

bool ClipSampler::wants(int64_t time_ns) {
  if (is_full()) return false;
  const auto time = static_cast<double>(time_ns);
  // Time that runs backwards is a reset of the server: the clip goes on from there.
  if (taken_ == 0 || time_ns < last_ns_) next_ns_ = time;
  last_ns_ = time_ns;
  if (time < next_ns_) return false;
  ++taken_;
  // Kept on the grid, so that a late state does not shift all that follow; after a gap the grid starts anew.
  next_ns_ += period_ns_;
  if (next_ns_ <= time) next_ns_ = time + period_ns_;
  return true;
}

bool ClipStore::has_room_for(uint64_t bytes) {
  is_cut_ = is_cut_ || bytes > limit_bytes_ - bytes_;
  if (!is_cut_) bytes_ += bytes;
  return !is_cut_;
}

void ClipStore::add(const std::shared_ptr<const Snapshot>& snapshot) {
  if (is_full() || !sampler_.wants(snapshot->sim_time_ns)) return;
  if (has_room_for(snapshot->lattice.size() * sizeof(int32_t))) snapshots_.push_back(snapshot);
}

void ClipStore::add(const Image& image, int64_t time_ns) {
  const bool is_other_size =
      !images_.empty() && (images_.front().width != image.width || images_.front().height != image.height);
  if (is_full() || is_other_size || !sampler_.wants(time_ns)) return;
  if (has_room_for(image.rgba.size())) images_.push_back(image);
}

}  // namespace strandcast

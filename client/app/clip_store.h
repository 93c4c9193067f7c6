// ClipStore: what a headless run keeps for its clip until it ends: decoded states or the server's pictures,
// at an even rate and within a bound, whatever the server sends. One thread; draws and writes nothing.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/pictures/image_codec.h"
#include "common/strands/snapshot.h"

namespace strandcast {

/// Of all that is kept. The longest clip (60 s at 60 Hz) of 50,000 vertices fits.
inline constexpr uint64_t kMaxClipBytes = 2ull << 30;

/// Picks states (or pictures) at an even rate of their times.
class ClipSampler {
 public:
  ClipSampler(double pictures_per_s, double duration_s);
  /// True when what has this time belongs into the clip.
  bool wants(int64_t time_ns);
  bool is_full() const { return taken_ >= wanted_; }
  size_t wanted() const { return wanted_; }

 private:
  double period_ns_;
  size_t wanted_;
  size_t taken_ = 0;
  int64_t last_ns_ = 0;
  double next_ns_ = 0.0;
};

class ClipStore {
 public:
  ClipStore(double pictures_per_s, double duration_s, uint64_t limit_bytes = kMaxClipBytes)
      : sampler_(pictures_per_s, duration_s), limit_bytes_(limit_bytes) {}

  /// Keeps the state when its simulation time belongs into the clip.
  void add(const std::shared_ptr<const Snapshot>& snapshot);
  /// Keeps the picture when `time_ns` belongs into the clip and it has the size of the first one: a clip has
  /// one size, and a server may halve its pictures for a slow link.
  void add(const Image& image, int64_t time_ns);

  /// Nothing more is kept: the clip has its length, or the bound is reached.
  bool is_full() const { return is_cut_ || sampler_.is_full(); }
  /// The bound cut it short.
  bool is_cut() const { return is_cut_; }
  const std::vector<std::shared_ptr<const Snapshot>>& snapshots() const { return snapshots_; }
  const std::vector<Image>& images() const { return images_; }

 private:
  bool has_room_for(uint64_t bytes);

  ClipSampler sampler_;
  const uint64_t limit_bytes_;
  uint64_t bytes_ = 0;
  bool is_cut_ = false;
  std::vector<std::shared_ptr<const Snapshot>> snapshots_;
  std::vector<Image> images_;
};

}  // namespace strandcast

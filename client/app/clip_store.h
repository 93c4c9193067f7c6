// ClipStore: stores decoded states or the server's pictures for the clip of a headless run, at an even rate
// and with bounded memory. One thread; draws and writes nothing.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/pictures/image_codec.h"
#include "common/strands/snapshot.h"

namespace strandcast {

/// Memory limit of the store. The longest clip (60 s at 60 Hz) of 50,000 vertices fits.
inline constexpr uint64_t kMaxClipBytes = 2ull << 30;

/// Selects states (or pictures) at an even rate of their times.
class ClipSampler {
 public:
  ClipSampler(double pictures_per_s, double duration_s);
  /// Returns whether a state or picture of this time belongs in the clip.
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

  /// Stores the state if its simulation time belongs in the clip.
  void add(const std::shared_ptr<const Snapshot>& snapshot);
  /// Stores the picture if `time_ns` belongs in the clip and its size is that of the first picture. A clip
  /// has one size, but a server may halve its pictures for a slow link.
  void add(const Image& image, int64_t time_ns);

  /// Returns whether nothing more is stored: the clip is complete, or the memory limit is reached.
  bool is_full() const { return is_cut_ || sampler_.is_full(); }
  /// Returns whether the memory limit has shortened the clip.
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

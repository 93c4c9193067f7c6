// FrameChain: of one stream of strands the newest keyframe and the deltas since, for those who join a relay.
// Bounded. Plain logic on given times, any one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/strands/frame_header.h"

namespace strandcast {

/// Age from which on a fresh keyframe serves joiners better if it has no more bytes than the chain's deltas.
inline constexpr int64_t kChainNs = 1'000'000'000;
/// Age from which on it does in any case: a joiner has to step through all of it.
inline constexpr int64_t kLongestChainNs = 2'000'000'000;
/// Largest number of deltas that a joining viewer waits for a keyframe; a longer chain is dropped.
inline constexpr size_t kMaxChainFrames = 240;
inline constexpr size_t kMaxChainBytes = 16u << 20;

class FrameChain {
 public:
  /// In the order of the stream; a delta that does not follow ends the chain.
  void add(const EncodedFramePtr& frame, int64_t time_ns);
  void clear();
  /// A keyframe and what follows it; empty while there is no keyframe.
  const std::vector<EncodedFramePtr>& frames() const { return frames_; }
  /// Whether a joiner is to begin with these frames; if not, with a keyframe made for it.
  bool serves_joiners() const;

 private:
  std::vector<EncodedFramePtr> frames_;
  size_t delta_bytes_ = 0;
  int64_t keyframe_ns_ = 0;
  int64_t newest_ns_ = 0;
};

}  // namespace strandcast

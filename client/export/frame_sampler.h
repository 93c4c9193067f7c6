// FrameSampler: makes frames at an even rate from states at any rate, with the viewers' interpolation. Keeps
// only the few states that the next frames need. Pure logic; one thread.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "common/base/frame_rate.h"
#include "common/replay/state_blend.h"

namespace strandcast {

struct SampledFrame {
  uint64_t index = 0;   // from 0
  double time_s = 0.0;  // simulated
  PosedStrands strands;
};

struct SampleRange {
  FrameRate fps;
  double from_s = 0.0;         // after the first state
  std::optional<double> to_s;  // likewise; empty: to the last state
  std::optional<int64_t> first_ns =
      {};                             // time of the first state, where others before the range are left out
  std::vector<int64_t> time_ns = {};  // simulated, of all frames; empty: even, by what is above
};

class FrameSampler {
 public:
  enum class Outcome {
    Kept,
    Repeated,  // its time is that of the state before: it replaces that one
    WentBack,  // time began anew: it is not kept, and no other will be
  };

  /// Starts a range; `fill` makes strands that states lack.
  FrameSampler(const SampleRange& range, StrandFill fill);

  Outcome add(std::shared_ptr<const Snapshot> state);
  /// Notes that no more states come, so that frames up to the last state are due.
  void finish() { is_finished_ = true; }
  /// Returns the next frame that the states so far determine.
  std::optional<SampledFrame> next();
  /// Returns whether all frames of the range were returned.
  bool is_done() const;

 private:
  int64_t time_ns(uint64_t index) const;
  void forget_states();

  SampleRange range_;
  StateBlend blend_;
  std::deque<std::shared_ptr<const Snapshot>> states_;
  std::optional<int64_t> first_ns_;  // of the first state
  uint64_t next_index_ = 0;
  bool is_finished_ = false;
};

}  // namespace strandcast

// TemporalPredictor: our prediction of integers in time, put around coders that have none. The movement of a
// vertex is foretold from its last movement, the change of that, and what its parent, the vertex nearer to
// the root, just did; four weights are fitted to each frame and sent. Encoder and decoder have one each. One
// thread.
#pragma once

#include <array>

#include "server/report/peers/integer_coder.h"

namespace strandcast {

/// In 1/1024, of: the last movement, its change; the change of the parent's movement now, and that before.
using TemporalWeights = std::array<int16_t, 4>;

class TemporalPredictor {
 public:
  /// Least squares over a sample of strands; all zero before the third frame.
  TemporalWeights fit(const IntegerPlanes& now) const;
  /// now - prediction; the frame itself before anything is known.
  IntegerPlanes residual(const IntegerPlanes& now, const TemporalWeights& weights) const;
  /// The inverse of residual().
  IntegerPlanes restored(const IntegerPlanes& residual, const TemporalWeights& weights) const;
  /// What residual() gives for the next frame: positions before anything is known.
  IntegerKind next_kind() const {
    return last_.value.empty() ? IntegerKind::Positions : IntegerKind::Residuals;
  }
  /// `now` becomes the last frame.
  void advance(const IntegerPlanes& now);

 private:
  std::vector<int32_t> predicted_row(size_t row, const int32_t* now, const TemporalWeights& weights) const;

  IntegerPlanes last_;
  std::vector<int32_t> movement_;         // into last_
  std::vector<int32_t> movement_before_;  // into the frame before that
};

}  // namespace strandcast

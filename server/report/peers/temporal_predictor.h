// TemporalPredictor: our prediction of integers in time, for coders without one. It predicts the motion of a
// vertex from its last motion and from that of its parent, the vertex nearer to the root. Four weights are
// fitted to each frame and sent. Encoder and decoder have one each. One thread.
#pragma once

#include <array>

#include "server/report/peers/integer_coder.h"

namespace strandcast {

/// Weights in 1/1024 of: the last motion, its change, the change of the parent's motion now, and that before.
using TemporalWeights = std::array<int16_t, 4>;

class TemporalPredictor {
 public:
  /// Fits the weights by least squares over a sample of strands; all zero before the third frame.
  TemporalWeights fit(const IntegerPlanes& now) const;
  /// Returns now - prediction; the frame itself before anything is known.
  IntegerPlanes residual(const IntegerPlanes& now, const TemporalWeights& weights) const;
  /// Inverse of residual().
  IntegerPlanes restored(const IntegerPlanes& residual, const TemporalWeights& weights) const;
  /// Returns what residual() will give for the next frame; Positions before anything is known.
  IntegerKind next_kind() const {
    return last_.value.empty() ? IntegerKind::Positions : IntegerKind::Residuals;
  }
  /// Makes `now` the last frame.
  void advance(const IntegerPlanes& now);

 private:
  std::vector<int32_t> predicted_row(size_t row, const int32_t* now, const TemporalWeights& weights) const;

  IntegerPlanes last_;
  std::vector<int32_t> movement_;         // into last_
  std::vector<int32_t> movement_before_;  // into the frame before that
};

}  // namespace strandcast

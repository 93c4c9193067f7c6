// FrameOrder: strands sorted along a Morton curve through their roots, so that a codec that uses array
// neighbours finds neighbours in space. Both sides compute it, so it costs no bits. Immutable.
#pragma once

#include "server/report/stream_codec.h"

namespace strandcast {

class FrameOrder {
 public:
  explicit FrameOrder(const StreamShape& shape);

  /// Returns (vertex_count x strand_count) points with the strands in the order of the curve.
  std::vector<glm::vec3> sorted(const std::vector<glm::vec3>& frame) const;
  /// The inverse of sorted().
  std::vector<glm::vec3> restored(const std::vector<glm::vec3>& sorted) const;

 private:
  std::vector<uint32_t> strand_at_;  // (strand_count) at each place of the curve
};

}  // namespace strandcast

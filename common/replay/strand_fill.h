// StrandFill: the strands that a stream for a slow link leaves out. Each goes with three near ones that were
// sent and fall as it does: every segment moves as theirs, keeps its rest length and half of what sets its
// rest shape apart. No network, no GL; one thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "common/math/strand_guides.h"
#include "common/strands/snapshot.h"

namespace strandcast {

class StrandFill {
 public:
  /// Makes an object without a rest shape, which fills nothing in.
  StrandFill() = default;
  /// `rest_in_head_m`: of all strands, (vertex_count x strand_count), strand fastest.
  StrandFill(std::span<const glm::vec3> rest_in_head_m, uint32_t vertex_count);

  /// Returns head-space positions of all strands, (vertex_count x strand_count), strand fastest. Strands of
  /// the snapshot are copied, the others are filled in. Returns only the snapshot's strands if it has all, or
  /// if there is no rest shape.
  std::vector<glm::vec3> positions(const Snapshot& snapshot);

 private:
  uint32_t strand_count_ = 0;
  uint32_t vertex_count_ = 0;
  std::vector<glm::vec3> rest_in_head_m_;
  uint32_t sent_count_ = 0;           // for which the guides were chosen
  std::vector<StrandGuides> guides_;  // of strands sent_count_ to strand_count_ - 1
};

}  // namespace strandcast

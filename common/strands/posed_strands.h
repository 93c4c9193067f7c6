// PosedStrands: strands as they are drawn, with the head that they stand on.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "common/math/bust.h"
#include "common/math/pose.h"

namespace strandcast {

/// What to draw: strands in head space as a viewer has them after decoding (and blending).
struct PosedStrands {
  Pose world_from_head;
  std::vector<glm::vec3>
      position_m;      // (vertex_count x strand_count) vertex-major, strand fastest, head space
  BustTurn bust{0.0};  // of neck and chest against the head
};

}  // namespace strandcast

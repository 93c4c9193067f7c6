// PosedStrands: strands to draw, with the pose of their head.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "common/math/bust.h"
#include "common/math/pose.h"

namespace strandcast {

/// Decoded (and interpolated) strands in head space, ready to draw.
struct PosedStrands {
  Pose world_from_head;
  std::vector<glm::vec3>
      position_m;      // (vertex_count x strand_count) vertex-major, strand fastest, head space
  BustTurn bust{0.0};  // of neck and chest against the head
};

}  // namespace strandcast

// HeadPath: how the head came to where it is, as far as the next substep needs it. Plain data, any thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

#include "common/kernels/step_input.h"

namespace strandcast {

struct HeadPath {
  glm::dquat world_from_head_rotation{1.0, 0.0, 0.0, 0.0};  // unit
  glm::dmat3 turn_per_s{0.0};  // velocity of a point by the turn of the last substep
  uint32_t step_index = 0;     // substeps since loading

  /// A strand at rest under a head of this rotation.
  static HeadPath at_rest(const glm::dquat& world_from_head_rotation);
  /// The path after a substep.
  void advance(const StepInput& input);
  /// The head jumps to this rotation and goes on turning as it did, seen from itself. Returns the turn.
  glm::dquat rebase(const glm::dquat& rotation);
};

}  // namespace strandcast

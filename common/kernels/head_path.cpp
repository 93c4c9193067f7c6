#include "common/kernels/head_path.h"

namespace strandcast {

HeadPath HeadPath::at_rest(const glm::dquat& world_from_head_rotation) {
  HeadPath path;
  path.world_from_head_rotation = limited_rotation(world_from_head_rotation);
  return path;
}

void HeadPath::advance(const StepInput& input) {
  const glm::dquat rotation = limited_rotation(input.world_from_head_rotation);
  const glm::dmat3 turned_back = glm::mat3_cast(world_from_head_rotation * glm::conjugate(rotation));
  turn_per_s = (glm::dmat3(1.0) - turned_back) / limited_substep_s(input);
  world_from_head_rotation = rotation;
  ++step_index;
}

glm::dquat HeadPath::rebase(const glm::dquat& rotation) {
  const glm::dquat next = limited_rotation(rotation);
  const glm::dquat turn = next * glm::conjugate(world_from_head_rotation);
  const glm::dmat3 turned = glm::mat3_cast(turn);
  turn_per_s = turned * turn_per_s * glm::transpose(turned);
  world_from_head_rotation = next;
  return turn;
}

}  // namespace strandcast

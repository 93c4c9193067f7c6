#include "common/kernels/step_input.h"

#include <algorithm>

namespace strandcast {

double limited_substep_s(const StepInput& input) {
  if (!(input.h_s >= kMinSubstepS)) return kMinSubstepS;
  return std::min(input.h_s, kMaxSubstepS);
}

glm::dquat limited_rotation(const glm::dquat& rotation) {
  const double squared = glm::dot(rotation, rotation);
  if (!std::isfinite(squared) || squared < 1e-12) return {1.0, 0.0, 0.0, 0.0};
  return rotation / std::sqrt(squared);
}

}  // namespace strandcast

// RodPlanes: what direct_rod's kernel reads of a rod at rest, as it follows from the rest shape of a strand
// that bends to it by itself: what a model is told against. Pure functions; private to common/strands/step.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace strandcast::step {

/// As in StepModel; what of a strand's stiffness is not known from its shape is 0.
struct RodPlanes {
  std::vector<glm::vec4> edge;    // (vertex_count x strand_count)
  std::vector<glm::vec4> strand;  // (kRodStrandRows x strand_count)
};

struct RodShapes {
  std::span<const glm::vec3> rest_in_head_m;  // (vertex_count x strand_count), strand fastest
  uint32_t strand_count;
  uint32_t vertex_count;
  uint32_t pinned_root_count;
  uint32_t pinned_tail_count;
  bool has_twist;
};
RodPlanes natural_rods(const RodShapes& shapes);

}  // namespace strandcast::step

// RodPlanes: inputs of direct_rod's kernel for a rod at rest, derived from the rest shape of a strand that
// bends to it without external forces. Models are coded as differences from them. Pure functions; private to
// common/strands/step.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace strandcast::step {

/// Planes as in StepModel; stiffness values that do not follow from the shape are 0.
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

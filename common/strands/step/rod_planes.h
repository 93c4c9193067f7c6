// RodPlanes: inputs of direct_rod's kernel for a rod that is at rest in the rest shape under a weight. Models
// are coded as differences from them. Pure functions with only + - * / and roots of doubles: the same bits on
// every machine. Private to common/strands/step.
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
  std::span<const uint8_t> has_tail;  // as StepModel
  bool has_twist;
  // Weight that the rest shape carries; none without stiffness.
  glm::vec3 weight_mps2{0.0f};
  double tip_length_m = 0.0;               // of hair that weighs as much as what hangs at the tip
  double twist_over_bend = 0.0;            // stiffness
  std::span<const float> bend_m4ps2 = {};  // (strand_count) stiffness

  uint32_t tail_count(uint32_t strand) const {
    return has_tail.empty() || has_tail[strand] != 0 ? pinned_tail_count : 0;
  }
};
RodPlanes natural_rods(const RodShapes& shapes);

}  // namespace strandcast::step

// StepBlock: the uniform block of shaders/sim/step.glsl (std140), filled once per substep. Plain data.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>

#include "server/sim/head_path.h"
#include "server/sim/strand_layout.h"
#include "server/sim/strand_parameters.h"
#include "shaders/shared/limits.h"

namespace strandcast {

struct StepBlock {
  std::array<glm::vec4, 3> world_from_head;
  std::array<glm::vec4, 3> carry;
  glm::vec4 head_velocity;
  glm::vec4 push;
  glm::vec4 support;
  glm::vec4 style;
  glm::vec4 contact;
  glm::uvec4 shape;
  uint32_t step_index;
  float follicle_cosine;
  float follicle_sine;
  uint32_t unused;
  std::array<glm::vec4, 3> previous_turn;
  glm::vec4 wind;
  std::array<glm::vec4, shader::kMaxGustWaves> gust_amplitude;
  std::array<glm::vec4, shader::kMaxGustWaves> gust_wave;
  std::array<glm::vec4, shader::kMaxSphereColliders> collider;
};
static_assert(sizeof(StepBlock) ==
              16 * (3 + 3 + 7 + 3 + 1 + 2 * shader::kMaxGustWaves + shader::kMaxSphereColliders));
static_assert(shader::kMaxGustWaves == kMaxGustWaves && shader::kMaxSphereColliders == kMaxSphereColliders);

/// The block for one substep; `head` is as before it. Inputs are held to the limits of strand_layout.h.
StepBlock make_step_block(const StepInput& input, const StrandParameters& parameters,
                          const StrandLayout& layout, const HeadPath& head);

}  // namespace strandcast

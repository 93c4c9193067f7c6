// StepBlock: the uniform block of shaders/sim/step.glsl (std140), filled once per substep. Plain data.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/glm.hpp>

#include "common/kernels/head_path.h"
#include "shaders/shared/limits.h"

namespace strandcast {

/// Pull to the groomed shape from which on it carries the whole weight of a sag-free groom; a weaker pull
/// carries its share, so a limp strand falls. At this pull a strand that sags would give way by half a metre.
inline constexpr double kSupportStiffnessPerS2 = 20.0;

/// Time by which the pull to the groomed shape looks ahead, s. Backward Euler looks a substep ahead and so
/// brakes what swings by half of that per second. With this time substeps brake alike, as those of a 60th of
/// a second do, up to twice as long; longer ones brake as much more as stays stable at any stiffness.
inline double pull_ahead_s(double substep_s) {
  constexpr double kBrakingS = 1.0 / 60.0;
  return std::max(kBrakingS, 0.5 * substep_s);
}

struct StrandParameters {
  double s_damping = 0.0;               // share of the velocity correction, 0..1
  double air_drag_per_s = 0.0;          // rate at which a strand takes on the air's velocity
  double style_stiffness_per_s2 = 0.0;  // pull to the groomed shape at the root
  double style_tip_share = 0.0;         // of that pull, what is left at the tip
  double sag_free = 0.0;                // share of the groom's gravity that the pull carries, 0..1
  double collider_friction = 0.0;       // Coulomb coefficient
  double max_speed_mps = 0.0;           // relative to the head
  double thrust_share = 1.0;            // share of the velocity correction kept when it is a thrust, 0..1
  double thickness_spread = 0.0;        // largest relative difference of a strand's thickness from the mean
};

/// Sizes of the strands that a step is for.
struct StrandCounts {
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;       // per strand
  uint32_t pinned_root_count = 0;  // leading vertices that follow the head, at least 1
  uint32_t tail_begin = 0;         // first vertex of the pinned tail, vertex_count when the tip is free
};

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
  glm::vec4 wind;  // w: pull_ahead_s()
  std::array<glm::vec4, shader::kMaxGustWaves> gust_amplitude;
  std::array<glm::vec4, shader::kMaxGustWaves> gust_wave;
  std::array<glm::vec4, shader::kMaxSphereColliders> collider;
  std::array<glm::vec4, 4> bust;
};
static_assert(sizeof(StepBlock) ==
              16 * (3 + 3 + 7 + 3 + 1 + 2 * shader::kMaxGustWaves + shader::kMaxSphereColliders + 4));
static_assert(shader::kMaxGustWaves == kMaxGustWaves && shader::kMaxSphereColliders == kMaxSphereColliders);

/// The block for one substep; `head` is as before it. Inputs are held to the limits of step_input.h.
StepBlock make_step_block(const StepInput& input, const StrandParameters& parameters,
                          const StrandCounts& counts, const HeadPath& head);

}  // namespace strandcast

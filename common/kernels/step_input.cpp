#include "common/kernels/step_input.h"

#include <algorithm>
#include <cmath>

#include "common/kernels/head_path.h"

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

namespace {

glm::vec4 pack(const glm::dvec3& vector, double w) {
  return glm::vec4(glm::dvec4(vector, w));
}

/// Columns of a matrix as a uniform block holds them.
std::array<glm::vec4, 3> block_columns(const glm::dmat3& matrix) {
  return {glm::vec4(glm::vec3(matrix[0]), 0.0f), glm::vec4(glm::vec3(matrix[1]), 0.0f),
          glm::vec4(glm::vec3(matrix[2]), 0.0f)};
}

}  // namespace

StepBlock make_step_block(const StepInput& input, const StrandParameters& parameters,
                          const StrandCounts& counts, const HeadPath& head) {
  const double h_s = limited_substep_s(input);
  const glm::dquat rotation = limited_rotation(input.world_from_head_rotation);
  const glm::dvec3 head_velocity = limited(input.head_shift_m, kMaxHeadShiftM) / h_s;
  const glm::dvec3 relative_wind = limited(input.wind_mps, kMaxWindMps) - head_velocity;
  const glm::dvec3 acceleration =
      limited(input.gravity_mps2, kMaxGravityMps2) + parameters.air_drag_per_s * relative_wind;

  StepBlock block{};
  block.world_from_head = block_columns(glm::mat3_cast(rotation));
  block.carry = block_columns(glm::mat3_cast(rotation * glm::conjugate(head.world_from_head_rotation)));
  block.head_velocity = pack(head_velocity, h_s);
  block.push = pack(h_s * acceleration, 1.0 / h_s);
  const glm::dvec3 groom_gravity = limited(input.groom_gravity_in_head_mps2, kMaxGravityMps2);
  block.support = pack(-h_s * parameters.sag_free * (rotation * groom_gravity), 1.0 / kSupportStiffnessPerS2);
  block.style = glm::vec4(glm::dvec4(parameters.style_stiffness_per_s2, parameters.style_tip_share,
                                     parameters.s_damping, parameters.max_speed_mps));
  block.contact = glm::vec4(glm::dvec4(parameters.collider_friction, parameters.air_drag_per_s,
                                       1.0 - parameters.thrust_share, parameters.thickness_spread));
  block.wind = pack(relative_wind, pull_ahead_s(h_s));
  block.step_index = head.step_index;
  block.follicle_cosine = static_cast<float>(std::cos(input.follicle_limit_rad));
  block.follicle_sine = static_cast<float>(std::sin(input.follicle_limit_rad));
  block.previous_turn = block_columns(head.turn_per_s);
  block.shape = {counts.strand_count, counts.vertex_count, counts.pinned_root_count, counts.tail_begin};
  const size_t wave_count = std::min<size_t>(input.gusts.size(), kMaxGustWaves);
  for (size_t i = 0; i < wave_count; ++i) {
    const GustWave& wave = input.gusts[i];
    const glm::dvec3 amplitude = limited(glm::dvec3(wave.amplitude_mps), kMaxWindMps);
    block.gust_amplitude[i] = pack(amplitude, limited(wave.phase_rad, kMaxPhaseRad));
    block.gust_wave[i] = pack(limited(glm::dvec3(wave.wave_vector_rad_per_m), kMaxPhaseRad), 0.0);
  }
  const size_t collider_count = std::min<size_t>(input.colliders.size(), kMaxSphereColliders);
  for (size_t i = 0; i < collider_count; ++i) {
    const SphereCollider& sphere = input.colliders[i];
    block.collider[i] = pack(limited(glm::dvec3(sphere.center_m), kMaxColliderM),
                             std::max(0.0, limited(sphere.radius_m, kMaxColliderM)));
  }
  // While nothing of it moves the bust is head.
  const BustInput& bust = input.bust;
  if (bust.rig.exists() && (bust.turn != BustTurn(0.0) || bust.turn_before != BustTurn(0.0))) {
    const auto whole = [](const BustTurn& turn) {
      return pack(turn, std::sqrt(std::max(1.0 - glm::dot(turn, turn), 0.0)));
    };
    block.bust = {whole(bust.turn), whole(bust.turn_before), glm::vec4(bust.rig.pivot_m, 1.0f),
                  bust.rig.share};
  }
  return block;
}

}  // namespace strandcast

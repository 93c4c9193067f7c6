#include "server/sim/reference_strands.h"

#include <algorithm>
#include <cmath>

#include "server/sim/reference_contact.h"

namespace strandcast {
namespace {

constexpr double kTinySegment = 1e-12;

}  // namespace

void ReferenceStrands::on_load() {
  const size_t n = layout().vertex_count;
  scratch_.target_m.resize(n);
  scratch_.old_m.resize(n);
  scratch_.predicted_m.resize(n);
  scratch_.placed_m.resize(n);
  scratch_.pushed_m.resize(n);
  scratch_.velocity_mps.resize(n);
  scratch_.inertia.resize(n);
  scratch_.segment_m.resize(n);
  scratch_.is_intact.resize(n);
  memory_.assign(layout().strand_count * memory_size(), 0.0);
  prepare();
}

void ReferenceStrands::step_strand(const ReferenceStep&, uint32_t strand_index,
                                   std::span<glm::dvec3> position_m, std::span<glm::dvec3> velocity_mps) {
  scratch_.index = strand_index;
  begin(scratch_, position_m, velocity_mps);
  for (uint32_t i = 0; i < layout().vertex_count; ++i)
    scratch_.predicted_m[i] = is_pinned(i) ? scratch_.target_m[i] : predict(scratch_, i);
  scratch_.placed_m = scratch_.predicted_m;
  solve(scratch_);
  for (uint32_t i = 0; i < layout().vertex_count; ++i) {
    position_m[i] = scratch_.placed_m[i];
    velocity_mps[i] = finish_velocity(scratch_, i);
  }
}

std::span<double> ReferenceStrands::memory_of(uint32_t strand_index) {
  return std::span(memory_).subspan(strand_index * memory_size(), memory_size());
}

void ReferenceStrands::forget(uint32_t strand_index) {
  const std::span<double> memory = memory_of(strand_index);
  std::fill(memory.begin(), memory.end(), 0.0);
}

void ReferenceStrands::begin(ReferenceStrand& strand, std::span<const glm::dvec3> position_m,
                             std::span<const glm::dvec3> velocity_mps) {
  strand.memory = memory_of(strand.index);
  for (uint32_t i = 0; i < layout().vertex_count; ++i) {
    const glm::dvec3 rest(layout().rest[layout().index(i, strand.index)]);
    const bool is_sound = is_sane(velocity_mps[i]) && is_sane(position_m[i]);
    strand.is_intact[i] = is_sound;
    if (!is_sound) forget(strand.index);
    strand.velocity_mps[i] = is_sound ? velocity_mps[i] - head_velocity_mps() : glm::dvec3(0.0);
    const double rate = air_drag_per_s(strand) + pull_ahead_s(h_s()) * style_stiffness_per_s2(strand, i);
    strand.inertia[i] = 1.0 + h_s() * rate;
    strand.target_m[i] = rotation() * rest;
    strand.old_m[i] = is_sane(position_m[i]) ? position_m[i] : strand.target_m[i];
    strand.segment_m[i] =
        i == 0 ? 0.0 : glm::distance(rest, glm::dvec3(layout().rest[layout().index(i - 1, strand.index)]));
    strand.pushed_m[i] = glm::dvec3(0.0);
  }
}

glm::dvec3 ReferenceStrands::uncarried_gravity_mps2(const ReferenceStrand& strand, uint32_t i) const {
  const double carried_share =
      parameters_.sag_free * std::min(1.0, style_stiffness_per_s2(strand, i) / kSupportStiffnessPerS2);
  const glm::dvec3 groom_gravity = limited(input().groom_gravity_in_head_mps2, kMaxGravityMps2);
  return limited(input().gravity_mps2, kMaxGravityMps2) - carried_share * (rotation() * groom_gravity);
}

glm::dvec3 ReferenceStrands::pulled_on_mps(const ReferenceStrand& strand, uint32_t i) const {
  const double stiffness = style_stiffness_per_s2(strand, i);
  const glm::dvec3 gravity = limited(input().gravity_mps2, kMaxGravityMps2);
  const glm::dvec3 held = stiffness * strand.target_m[i] + (uncarried_gravity_mps2(strand, i) - gravity);
  return (pull_ahead_s(h_s()) - h_s()) * (held - glm::conjugate(carry()) * held);
}

double ReferenceStrands::thickness(const ReferenceStrand& strand) const {
  return thickness_factor(glm::vec3(layout().rest[layout().index(0, strand.index)]),
                          parameters_.thickness_spread);
}

double ReferenceStrands::air_drag_per_s(const ReferenceStrand& strand) const {
  return parameters_.air_drag_per_s / (thickness(strand) * thickness(strand));
}

double ReferenceStrands::style_stiffness_per_s2(const ReferenceStrand& strand, uint32_t i) const {
  const double from_tip = 1.0 - static_cast<double>(layout().arc[layout().index(i, strand.index)]);
  const double tip_share = parameters_.style_tip_share;
  return thickness(strand) * thickness(strand) * parameters_.style_stiffness_per_s2 *
         (tip_share + (1.0 - tip_share) * from_tip * from_tip);
}

// Implicit for the linear drag toward the air and the linear pull to the groomed shape, forward for the rest,
// written for the velocity u relative to the head joint, which moves at V during the substep:
//   (1 + h k + h a s_i) u = v - V + h (g - f_i R g_0 + k (w - V)) + h s_i (target - x) + b,
//   x_predicted = x + h u.
// With a = h and b = 0 that is backward Euler: the pull is that at the end of the substep, which brakes a
// swing at the rate h s_i / 2, less in shorter steps. So it is looked up a = pull_ahead_s(h) ahead, where the
// target will have gone on: b = (a - h) / h times the change of h (s_i target - f_i R g_0) in the substep. R
// turns the head; g_0 is the gravity that the groom was made under, in head space. The share f_i of it that
// the pull carries is a pre-stress: it moves the target up by f_i R g_0 / s_i, just as far as g = R g_0 lets
// it sag.
glm::dvec3 ReferenceStrands::predict(const ReferenceStrand& strand, uint32_t i) const {
  const double stiffness = style_stiffness_per_s2(strand, i);
  const double drag = air_drag_per_s(strand);
  const glm::dvec3 relative_air = air_velocity_mps(input(), strand.old_m[i]) - head_velocity_mps();
  const glm::dvec3 impulse =
      strand.velocity_mps[i] + h_s() * (uncarried_gravity_mps2(strand, i) + drag * relative_air) +
      h_s() * stiffness * (strand.target_m[i] - strand.old_m[i]) + pulled_on_mps(strand, i);
  const glm::dvec3 u = impulse / (1.0 + h_s() * drag + h_s() * pull_ahead_s(h_s()) * stiffness);
  return strand.old_m[i] + h_s() * shortened(u, parameters_.max_speed_mps);
}

void ReferenceStrands::place(ReferenceStrand& strand, uint32_t i) const {
  const glm::dvec3 start = strand.placed_m[i - 1];
  const double length = strand.segment_m[i];
  glm::dvec3 direction = strand.predicted_m[i] - start;
  // No direction to keep: take the groomed one.
  if (glm::length(direction) < kTinySegment) direction = strand.target_m[i] - strand.target_m[i - 1];
  const double norm = glm::length(direction);
  glm::dvec3 end = norm < kTinySegment ? start : start + length * (direction / norm);

  const glm::dvec3 outside =
      pushed_out({input(), carry(), parameters_.collider_friction}, {strand.old_m[i], start, end, length});
  strand.pushed_m[i] = outside - end;
  end = outside;
  if (layout().pinned_tail_count > 0) {
    const uint32_t tail = layout().tail_begin();
    double reach = 0.0;
    for (uint32_t j = i + 1; j <= tail; ++j) reach += strand.segment_m[j];
    const glm::dvec3 anchor = strand.target_m[tail];
    const bool is_last_free = i + 1 == tail;
    if (is_last_free || glm::distance(end, anchor) > reach) {
      end = turned_onto_sphere({strand.old_m[i], start, end, length}, anchor, reach);
    }
  }
  strand.placed_m[i] = end;
}

// Woodhouse 2017, 2.1.4: v_i = (p_i(t+h) - p_i(t)) / h - s_damping d_(i+1) / h, where d is what the length
// constraint moved a vertex by; friction and the speed limit are ours.
glm::dvec3 ReferenceStrands::finish_velocity(const ReferenceStrand& strand, uint32_t i) const {
  glm::dvec3 u = way_m(strand, i) / h_s();
  const bool has_next = i + 1 < layout().vertex_count && !is_pinned(i) && !is_pinned(i + 1);
  if (has_next) {
    glm::dvec3 correction = strand.placed_m[i + 1] - strand.predicted_m[i + 1] - strand.pushed_m[i + 1];
    // A string takes no thrust: of a correction that points away from vertex i only a share counts.
    const glm::dvec3 segment = strand.placed_m[i + 1] - strand.placed_m[i];
    if (const double length_m = glm::length(segment); length_m > kTinySegment) {
      const glm::dvec3 direction = segment / length_m;
      const double thrust_m = std::max(0.0, glm::dot(correction, direction));
      correction -= (1.0 - parameters_.thrust_share) * thrust_m * direction;
    }
    u -= parameters_.s_damping * correction / h_s();
  }
  return shortened(u, parameters_.max_speed_mps) + head_velocity_mps();
}

}  // namespace strandcast

#include "server/sim/reference_strands.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"

namespace strandcast {
namespace {

constexpr double kTinyLength = 1e-12;

bool is_sane(const glm::dvec3& value) {
  return glm::dot(value, value) < 1e30;
}

glm::dvec3 shortened(const glm::dvec3& value, double longest) {
  const double length = glm::length(value);
  return length > longest ? value * (longest / length) : value;
}

/// Any unit vector at right angles to a unit vector.
glm::dvec3 any_perpendicular(const glm::dvec3& axis) {
  const glm::dvec3 other = std::abs(axis.x) < 0.6 ? glm::dvec3(1.0, 0.0, 0.0) : glm::dvec3(0.0, 1.0, 0.0);
  return glm::normalize(glm::cross(axis, other));
}

/// Turns a segment of the given length about its start until its end lies on the sphere (center, radius):
/// both equations of 003 figure 4.1 at once. The nearest end that can be had when the two spheres do not
/// meet.
glm::dvec3 turned_onto_sphere(const glm::dvec3& start, const glm::dvec3& end, double length,
                              const glm::dvec3& center, double radius) {
  const glm::dvec3 to_center = center - start;
  const double distance = glm::length(to_center);
  if (distance < kTinyLength || length < kTinyLength) return end;
  const glm::dvec3 axis = to_center / distance;
  // Law of cosines in the triangle start, end, center.
  const double cosine = std::clamp(
      (length * length + distance * distance - radius * radius) / (2.0 * length * distance), -1.0, 1.0);
  glm::dvec3 side = (end - start) - axis * glm::dot(end - start, axis);
  const double side_length = glm::length(side);
  side = side_length > kTinyLength ? side / side_length : any_perpendicular(axis);
  return start + length * (cosine * axis + std::sqrt(1.0 - cosine * cosine) * side);
}

}  // namespace

Status ReferenceStrands::load(const Groom& groom, const glm::dquat& world_from_head) {
  ASSIGN_OR_RETURN(layout_, make_strand_layout(groom));
  previous_rotation_ = limited_rotation(world_from_head);
  position_m_.resize(layout_.size());
  velocity_mps_.assign(layout_.size(), glm::dvec3(0.0));
  for (size_t i = 0; i < layout_.size(); ++i)
    position_m_[i] = previous_rotation_ * glm::dvec3(layout_.rest[i]);
  const size_t n = layout_.vertex_count;
  scratch_.target_m.resize(n);
  scratch_.old_m.resize(n);
  scratch_.predicted_m.resize(n);
  scratch_.placed_m.resize(n);
  scratch_.pushed_m.resize(n);
  scratch_.segment_m.resize(n);
  return {};
}

void ReferenceStrands::substep(const StepInput& input) {
  input_ = &input;
  h_s_ = limited_substep_s(input);
  rotation_ = limited_rotation(input.world_from_head);
  head_velocity_mps_ = limited(input.head_shift_m, kMaxHeadShiftM) / h_s_;
  for (uint32_t strand_index = 0; strand_index < layout_.strand_count; ++strand_index) {
    begin(scratch_, strand_index);
    for (uint32_t i = 0; i < layout_.vertex_count; ++i) {
      scratch_.predicted_m[i] = is_pinned(i) ? scratch_.target_m[i] : predict(scratch_, strand_index, i);
    }
    scratch_.placed_m = scratch_.predicted_m;
    solve(scratch_);
    for (uint32_t i = 0; i < layout_.vertex_count; ++i) {
      position_m_[layout_.index(i, strand_index)] = scratch_.placed_m[i];
      velocity_mps_[layout_.index(i, strand_index)] = finish_velocity(scratch_, i);
    }
  }
  previous_rotation_ = rotation_;
  input_ = nullptr;
}

void ReferenceStrands::begin(ReferenceStrand& strand, uint32_t strand_index) const {
  for (uint32_t i = 0; i < layout_.vertex_count; ++i) {
    const size_t at = layout_.index(i, strand_index);
    const glm::dvec3 rest(layout_.rest[at]);
    strand.target_m[i] = rotation_ * rest;
    strand.old_m[i] = is_sane(position_m_[at]) ? position_m_[at] : strand.target_m[i];
    strand.segment_m[i] =
        i == 0 ? 0.0 : glm::distance(rest, glm::dvec3(layout_.rest[layout_.index(i - 1, strand_index)]));
    strand.pushed_m[i] = glm::dvec3(0.0);
  }
}

// Backward Euler for the linear drag toward the air and the linear pull to the groomed shape, forward for the
// rest, written for the velocity u relative to the head joint, which moves at V during the substep:
//   (1 + h k + h^2 s_i) u = v - V + h (g + k (w - V)) + h s_i (target - x),   x_predicted = x + h u.
glm::dvec3 ReferenceStrands::predict(const ReferenceStrand& strand, uint32_t strand_index, uint32_t i) const {
  const size_t at = layout_.index(i, strand_index);
  const glm::dvec3 old_velocity =
      is_sane(velocity_mps_[at]) && is_sane(position_m_[at]) ? velocity_mps_[at] : head_velocity_mps_;
  const double from_tip = 1.0 - static_cast<double>(layout_.arc[at]);
  const double share =
      parameters_.style_tip_share + (1.0 - parameters_.style_tip_share) * from_tip * from_tip;
  const double stiffness = parameters_.style_stiffness_per_s2 * share;
  const double drag = parameters_.air_drag_per_s;
  const glm::dvec3 gravity = limited(input_->gravity_mps2, kMaxGravityMps2);
  const glm::dvec3 relative_air = air_velocity(strand.old_m[i]) - head_velocity_mps_;
  const glm::dvec3 impulse = (old_velocity - head_velocity_mps_) + h_s_ * (gravity + drag * relative_air) +
                             h_s_ * stiffness * (strand.target_m[i] - strand.old_m[i]);
  const glm::dvec3 u = impulse / (1.0 + h_s_ * drag + h_s_ * h_s_ * stiffness);
  return strand.old_m[i] + h_s_ * shortened(u, parameters_.max_speed_mps);
}

glm::dvec3 ReferenceStrands::air_velocity(const glm::dvec3& point_m) const {
  glm::dvec3 result = limited(input_->wind_mps, kMaxWindMps);
  const size_t count = std::min<size_t>(input_->gusts.size(), kMaxGustWaves);
  for (size_t i = 0; i < count; ++i) {
    const GustWave& wave = input_->gusts[i];
    const glm::dvec3 wave_vector = limited(glm::dvec3(wave.wave_vector_rad_per_m), kMaxPhaseRad);
    const double angle = glm::dot(wave_vector, point_m) - limited(wave.phase_rad, kMaxPhaseRad);
    result += limited(glm::dvec3(wave.amplitude_mps), kMaxWindMps) * std::sin(angle);
  }
  return result;
}

void ReferenceStrands::place(ReferenceStrand& strand, uint32_t i) const {
  const glm::dvec3 start = strand.placed_m[i - 1];
  const double length = strand.segment_m[i];
  glm::dvec3 direction = strand.predicted_m[i] - start;
  // No direction to keep: take the groomed one.
  if (glm::length(direction) < kTinyLength) direction = strand.target_m[i] - strand.target_m[i - 1];
  const double norm = glm::length(direction);
  glm::dvec3 end = norm < kTinyLength ? start : start + length * (direction / norm);

  strand.pushed_m[i] = glm::dvec3(0.0);
  push_out(strand, i, start, end);
  if (layout_.pinned_tail_count > 0) {
    const uint32_t tail = layout_.tail_begin();
    double reach = 0.0;
    for (uint32_t j = i + 1; j <= tail; ++j) reach += strand.segment_m[j];
    const glm::dvec3 anchor = strand.target_m[tail];
    const bool is_last_free = i + 1 == tail;
    if (is_last_free || glm::distance(end, anchor) > reach) {
      end = turned_onto_sphere(start, end, length, anchor, reach);
    }
  }
  strand.placed_m[i] = end;
}

// 003 solves collider and length constraints in turn and leaves the exact solution of both (figure 4.1) out
// for its cost; turning the segment onto the sphere is that exact solution. Several colliders: out of the one
// with the largest r^2 - |p - c|^2 first, then once more.
void ReferenceStrands::push_out(ReferenceStrand& strand, uint32_t i, const glm::dvec3& start,
                                glm::dvec3& end) const {
  const size_t collider_count = std::min<size_t>(input_->colliders.size(), kMaxSphereColliders);
  const int rounds = collider_count > 1 ? 2 : 1;
  for (int round = 0; round < rounds; ++round) {
    double most = 0.0;
    glm::dvec3 center(0.0);
    double radius = 0.0;
    for (size_t c = 0; c < collider_count; ++c) {
      const glm::dvec3 candidate = limited(glm::dvec3(input_->colliders[c].center_m), kMaxColliderM);
      const double r = std::max(0.0, limited(input_->colliders[c].radius_m, kMaxColliderM));
      const double inside = r * r - glm::dot(end - candidate, end - candidate);
      if (inside <= most) continue;
      most = inside;
      center = candidate;
      radius = r;
    }
    if (most <= 0.0) return;
    const glm::dvec3 held = held_by_friction(strand.old_m[i], end, center, radius);
    const glm::dvec3 turned = turned_onto_sphere(start, held, strand.segment_m[i], center, radius);
    strand.pushed_m[i] += turned - end;
    end = turned;
  }
}

// Coulomb friction in displacements: sliding over the collider, which turns rigidly with the head, is undone
// up to the friction coefficient times the depth that the collider has to push back.
glm::dvec3 ReferenceStrands::held_by_friction(const glm::dvec3& old, const glm::dvec3& end,
                                              const glm::dvec3& center, double radius) const {
  const double distance = glm::distance(end, center);
  if (distance < kTinyLength) return end;
  const glm::dvec3 normal = (end - center) / distance;
  const glm::dvec3 carried = rotation_ * (glm::conjugate(previous_rotation_) * old);
  const glm::dvec3 slip = end - carried;
  const glm::dvec3 sliding = slip - normal * glm::dot(slip, normal);
  const double way = glm::length(sliding);
  if (way < kTinyLength) return end;
  return end - sliding * std::min(1.0, parameters_.collider_friction * (radius - distance) / way);
}

// 003 section 2.1.4: v_i = (p_i(t+h) - p_i(t)) / h - s_damping d_(i+1) / h, where d is what the length
// constraint moved a vertex by; friction and the speed limit are ours.
glm::dvec3 ReferenceStrands::finish_velocity(const ReferenceStrand& strand, uint32_t i) const {
  glm::dvec3 u = (strand.placed_m[i] - strand.old_m[i]) / h_s_;
  const bool has_next = i + 1 < layout_.vertex_count && !is_pinned(i) && !is_pinned(i + 1);
  if (has_next) {
    const glm::dvec3 correction = strand.placed_m[i + 1] - strand.predicted_m[i + 1] - strand.pushed_m[i + 1];
    u -= parameters_.s_damping * correction / h_s_;
  }
  return shortened(u, parameters_.max_speed_mps) + head_velocity_mps_;
}

void ReferenceStrands::read(SolverState& state) {
  state.position_m.resize(layout_.size());
  state.velocity_mps.resize(layout_.size());
  for (size_t i = 0; i < layout_.size(); ++i) {
    state.position_m[i] = glm::vec3(position_m_[i]);
    state.velocity_mps[i] = glm::vec3(velocity_mps_[i]);
  }
}

void ReferenceStrands::write(const SolverState& state) {
  CHECK(state.position_m.size() == layout_.size() && state.velocity_mps.size() == layout_.size());
  for (size_t i = 0; i < layout_.size(); ++i) {
    position_m_[i] = glm::dvec3(state.position_m[i]);
    velocity_mps_[i] = glm::dvec3(state.velocity_mps[i]);
  }
}

uint64_t ReferenceStrands::memory_bytes() const {
  return layout_.size() * (2 * sizeof(glm::dvec3) + sizeof(glm::vec4) + sizeof(float));
}

}  // namespace strandcast

#include "server/sim/reference_solver.h"

#include "common/base/check.h"
#include "server/sim/reference_follicle.h"

namespace strandcast {
namespace {

constexpr double kBrokenM = 1e12;  // or m/s

}  // namespace

bool is_sane(const glm::dvec3& value) {
  return glm::dot(value, value) < kBrokenM * kBrokenM;
}

Status ReferenceSolver::load(const Groom& groom, const glm::dquat& world_from_head_rotation) {
  ASSIGN_OR_RETURN(layout_, make_strand_layout(groom, most_vertices_));
  head_ = HeadPath::at_rest(world_from_head_rotation);
  is_at_rest_ = true;
  position_m_.clear();
  for (uint32_t s = 0; s < layout_.strand_count; ++s)
    for (uint32_t i = 0; i < layout_.vertex_count; ++i)
      position_m_.push_back(head_.world_from_head_rotation * glm::dvec3(layout_.rest[layout_.index(i, s)]));
  velocity_mps_.assign(layout_.size(), glm::dvec3(0.0));
  on_load();
  return {};
}

void ReferenceSolver::substep(const StepInput& input) {
  ReferenceStep step;
  step.input = &input;
  step.h_s = limited_substep_s(input);
  step.rotation = limited_rotation(input.world_from_head_rotation);
  step.carry = step.rotation * glm::conjugate(head_.world_from_head_rotation);
  step.shift_m = limited(input.head_shift_m, kMaxHeadShiftM);
  step.head_velocity_mps = step.shift_m / step.h_s;
  step.before = head_;
  on_step(step);
  const size_t n = layout_.vertex_count;
  const uint32_t tail_count = layout_.pinned_tail_count;
  for (uint32_t s = 0; s < layout_.strand_count; ++s) {
    // Models see what this strand pins.
    layout_.pinned_tail_count = layout_.is_mixed() && layout_.has_tail[s] == 0 ? 0 : tail_count;
    step_strand(step, s, std::span(position_m_).subspan(s * n, n),
                std::span(velocity_mps_).subspan(s * n, n));
  }
  layout_.pinned_tail_count = tail_count;
  if (has_follicle_limit(input)) hold_roots(step);
  head_.advance(input);
  is_at_rest_ = false;
}

// Where a tip is held too, lengths could not be kept.
void ReferenceSolver::hold_roots(const ReferenceStep& step) {
  const uint32_t first = layout_.pinned_root_count;
  const size_t n = layout_.vertex_count;
  if (first >= n) return;
  for (uint32_t s = 0; s < layout_.strand_count; ++s) {
    if (layout_.tail_count(s) > 0) continue;
    ReferenceRoot root;
    root.groomed = step.rotation * (glm::dvec3(layout_.rest[layout_.index(first, s)]) -
                                    glm::dvec3(layout_.rest[layout_.index(first - 1, s)]));
    root.first = first;
    root.position_m = std::span(position_m_).subspan(s * n, n);
    root.velocity_mps = std::span(velocity_mps_).subspan(s * n, n);
    const glm::dvec3& end = root.position_m[first];
    root.follicle_mps = step.head_velocity_mps + (end - glm::conjugate(step.carry) * end) / step.h_s;
    unheld_m_.assign(root.position_m.begin(), root.position_m.end());
    if (hold_root(*step.input, root)) go_along(s, unheld_m_);
  }
}

void ReferenceSolver::read(SolverState& state) {
  state.position_m.resize(layout_.size());
  state.velocity_mps.resize(layout_.size());
  size_t from = 0;
  for (uint32_t s = 0; s < layout_.strand_count; ++s) {
    for (uint32_t i = 0; i < layout_.vertex_count; ++i, ++from) {
      state.position_m[layout_.index(i, s)] = glm::vec3(position_m_[from]);
      state.velocity_mps[layout_.index(i, s)] = glm::vec3(velocity_mps_[from]);
    }
  }
}

// A strand that is written as it was read keeps its doubles.
void ReferenceSolver::write(const SolverState& state) {
  CHECK(state.position_m.size() == layout_.size() && state.velocity_mps.size() == layout_.size());
  for (uint32_t s = 0; s < layout_.strand_count; ++s) {
    const size_t begin = size_t{s} * layout_.vertex_count;
    bool is_changed = false;
    for (uint32_t i = 0; i < layout_.vertex_count; ++i) {
      const size_t at = layout_.index(i, s);
      is_changed = is_changed || state.position_m[at] != glm::vec3(position_m_[begin + i]) ||
                   state.velocity_mps[at] != glm::vec3(velocity_mps_[begin + i]);
    }
    if (!is_changed) continue;
    is_at_rest_ = false;
    for (uint32_t i = 0; i < layout_.vertex_count; ++i) {
      position_m_[begin + i] = glm::dvec3(state.position_m[layout_.index(i, s)]);
      velocity_mps_[begin + i] = glm::dvec3(state.velocity_mps[layout_.index(i, s)]);
    }
    forget(s);
  }
}

void ReferenceSolver::rebase(const glm::dquat& world_from_head_rotation) {
  const glm::dquat turn = head_.rebase(world_from_head_rotation);
  for (auto* values : {&position_m_, &velocity_mps_})
    for (glm::dvec3& value : *values) value = turn * value;
  turn_memory(turn);
}

uint64_t ReferenceSolver::memory_bytes() const {
  return layout_.size() * (2 * sizeof(glm::dvec3) + sizeof(glm::vec4) + sizeof(float)) + model_bytes();
}

}  // namespace strandcast

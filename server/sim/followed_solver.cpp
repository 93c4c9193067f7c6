#include "server/sim/followed_solver.h"

#include <algorithm>

#include "common/base/check.h"

namespace strandcast {
namespace {

/// How far ahead guides are looked at for the velocities of who follows them: short beside a step, long
/// beside the rounding of positions.
constexpr float kAheadS = 1e-3f;

void turn(const glm::dmat3& turn, std::span<const glm::vec3> from, std::span<glm::vec3> to) {
  const glm::mat3 turn_in_float(turn);
  std::transform(from.begin(), from.end(), to.begin(), [&](const glm::vec3& v) { return turn_in_float * v; });
}

void take_first(std::span<const glm::vec3> all, uint32_t strand_count, uint32_t count,
                std::vector<glm::vec3>& first) {
  const size_t vertex_count = all.size() / strand_count;
  first.resize(vertex_count * count);
  for (size_t v = 0; v < vertex_count; ++v)
    std::copy_n(all.begin() + static_cast<ptrdiff_t>(v * strand_count), count,
                first.begin() + static_cast<ptrdiff_t>(v * count));
}

/// Guides are where they were, to the last bit.
void put_first(std::span<const glm::vec3> first, uint32_t count, uint32_t strand_count,
               std::vector<glm::vec3>& all) {
  for (size_t v = 0; v < first.size() / count; ++v)
    std::copy_n(first.begin() + static_cast<ptrdiff_t>(v * count), count,
                all.begin() + static_cast<ptrdiff_t>(v * strand_count));
}

}  // namespace

Groom first_strands(const Groom& groom, uint32_t count) {
  CHECK(count <= groom.strand_count());
  Groom first = groom;
  first.offset.resize(count + 1);
  first.rest_position_m.resize(first.offset.back());
  first.pinned.resize(first.offset.back());
  if (!first.root_uv.empty()) first.root_uv.resize(count);
  return first;
}

Status FollowedSolver::load(const Groom& groom, const glm::dquat& world_from_head_rotation) {
  if (!can_follow(groom))
    return make_error(
        ErrorCode::BadInput,
        "strands that are held at their tips cannot follow others: leave detail.simulated_share "
        "and detail.far_share at 1");
  const uint32_t count = strandcast::guide_count(groom.strand_count(), share_);
  RETURN_IF_ERROR(guides_->load(first_strands(groom, count), world_from_head_rotation));
  follow_.emplace(groom, count);
  world_from_head_rotation_ = world_from_head_rotation;
  head_velocity_mps_ = head_spin_radps_ = glm::dvec3(0.0);
  is_followed_ = false;
  const size_t size = size_t{follow_->strand_count()} * follow_->vertex_count();
  all_.position_m.resize(size);
  all_.velocity_mps.resize(size);
  in_head_m_.resize(size + size_t{count} * follow_->vertex_count());
  position_blocks_ = StrandBlocks(follow_->strand_count(), follow_->vertex_count());
  velocity_blocks_ = StrandBlocks(follow_->strand_count(), follow_->vertex_count());
  return {};
}

void FollowedSolver::substep(const StepInput& input) {
  guides_->substep(input);
  const glm::dquat rotation = limited_rotation(input.world_from_head_rotation);
  const double h_s = limited_substep_s(input);
  head_velocity_mps_ = limited(input.head_shift_m, kMaxHeadShiftM) / h_s;
  glm::dquat turn = rotation * glm::inverse(world_from_head_rotation_);
  if (turn.w < 0.0) turn = -turn;
  const double angle = glm::angle(turn);
  head_spin_radps_ = angle > 0.0 ? glm::axis(turn) * (angle / h_s) : glm::dvec3(0.0);
  world_from_head_rotation_ = rotation;
  is_followed_ = false;
}

void FollowedSolver::expand(const std::vector<glm::vec3>& guides_in_world_m,
                            const glm::dquat& world_from_head_rotation,
                            std::vector<glm::vec3>& all_in_world_m) {
  const glm::dmat3 world_from_head = glm::mat3_cast(world_from_head_rotation);
  const std::span<glm::vec3> guides_in_head = std::span(in_head_m_).first(guides_in_world_m.size());
  const std::span<glm::vec3> all_in_head = std::span(in_head_m_).subspan(guides_in_world_m.size());
  turn(glm::transpose(world_from_head), guides_in_world_m, guides_in_head);
  follow_->follow(guides_in_head, all_in_head);
  all_in_world_m.resize(all_in_head.size());
  turn(world_from_head, all_in_head, all_in_world_m);
  put_first(guides_in_world_m, follow_->guide_count(), follow_->strand_count(), all_in_world_m);
}

void FollowedSolver::follow_guides() {
  if (is_followed_) return;
  guides_->read(of_guides_);
  expand(of_guides_.position_m, world_from_head_rotation_, all_.position_m);
  follow_->blend(of_guides_.velocity_mps, all_.velocity_mps);
  pack_blocks(all_.position_m, position_blocks_);
  pack_blocks(all_.velocity_mps, velocity_blocks_);
  is_followed_ = true;
}

SolverBlocks FollowedSolver::read_blocks() {
  follow_guides();
  return {position_blocks_.view(), velocity_blocks_.view()};
}

// Seen from the head joint strands are looked at once more a little later: what they have moved by is their
// velocity, beside the head's.
void FollowedSolver::read(SolverState& state) {
  guides_->read(of_guides_);
  expand(of_guides_.position_m, world_from_head_rotation_, state.position_m);
  const glm::vec3 head_velocity(head_velocity_mps_), head_spin(head_spin_radps_);
  const size_t pinned = size_t{follow_->pinned_count()} * follow_->guide_count();
  std::vector<glm::vec3> ahead(of_guides_.position_m);
  for (size_t i = 0; i < ahead.size(); ++i) {
    const glm::vec3 relative =
        i < pinned ? glm::cross(head_spin, ahead[i]) : of_guides_.velocity_mps[i] - head_velocity;
    ahead[i] += kAheadS * relative;
  }
  const double spin = glm::length(head_spin_radps_);
  const glm::dquat turn_ahead =
      spin > 0.0 ? glm::angleAxis(spin * kAheadS, head_spin_radps_ / spin) : glm::dquat(1.0, 0.0, 0.0, 0.0);
  expand(ahead, turn_ahead * world_from_head_rotation_, state.velocity_mps);
  for (size_t i = 0; i < state.velocity_mps.size(); ++i)
    state.velocity_mps[i] = head_velocity + (state.velocity_mps[i] - state.position_m[i]) / kAheadS;
  put_first(of_guides_.velocity_mps, follow_->guide_count(), follow_->strand_count(), state.velocity_mps);
  is_followed_ = false;
}

void FollowedSolver::write(const SolverState& state) {
  take_first(state.position_m, follow_->strand_count(), follow_->guide_count(), of_guides_.position_m);
  take_first(state.velocity_mps, follow_->strand_count(), follow_->guide_count(), of_guides_.velocity_mps);
  guides_->write(of_guides_);
  is_followed_ = false;
}

void FollowedSolver::rebase(const glm::dquat& world_from_head_rotation) {
  guides_->rebase(world_from_head_rotation);
  head_velocity_mps_ = head_spin_radps_ = glm::dvec3(0.0);
  world_from_head_rotation_ = world_from_head_rotation;
  is_followed_ = false;
}

uint64_t FollowedSolver::memory_bytes() const {
  if (!follow_) return guides_->memory_bytes();
  return guides_->memory_bytes() + follow_->size_bytes() + in_head_m_.size() * sizeof(glm::vec3) +
         (all_.position_m.size() + all_.velocity_mps.size()) * sizeof(glm::vec3) +
         (position_blocks_.size() + velocity_blocks_.size()) * sizeof(float);
}

}  // namespace strandcast

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

}  // namespace

SimulatedPart simulated_part(const SceneDesc& scene, const RuntimeFacts& facts, const Groom& groom) {
  const SceneFeatures features = analyse(scene, facts);
  if (!can_follow(groom)) return {};
  return {features.has_followed_strands ? simulated_share(scene, facts) : 1.0,
          features.has_fewer_vertices ? kFarVertexStride : 1};
}

Groom simulated_groom(const Groom& groom, const SimulatedPart& part) {
  const Groom guides = first_strands(groom, guide_count(groom.strand_count(), part.strand_share));
  return VertexFollow(guides, part.vertex_stride).simulated(guides);
}

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
  const uint32_t count = strandcast::guide_count(groom.strand_count(), part_.strand_share);
  const Groom guides = first_strands(groom, count);
  vertices_.emplace(guides, part_.vertex_stride);
  RETURN_IF_ERROR(guides_->load(vertices_->simulated(guides), world_from_head_rotation));
  follow_.emplace(groom, count);
  world_from_head_rotation_ = world_from_head_rotation;
  head_velocity_mps_ = head_spin_radps_ = glm::dvec3(0.0);
  skin_.spheres.clear();
  skin_.bust = {};
  is_followed_ = false;
  const size_t size = size_t{follow_->strand_count()} * follow_->vertex_count();
  all_.position_m.resize(size);
  all_.velocity_mps.resize(size);
  all_in_head_m_.resize(size);
  simulated_in_head_m_.resize(vertices_->kept_size());
  guides_m_.resize(size_t{count} * follow_->vertex_count());
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
  const glm::dquat head_from_world = glm::conjugate(rotation);
  skin_.spheres.clear();
  for (const SphereCollider& sphere : input.colliders)
    skin_.spheres.push_back({glm::vec3(head_from_world * glm::dvec3(sphere.center_m)), sphere.radius_m});
  skin_.bust = input.bust;
  is_followed_ = false;
}

void FollowedSolver::expand(const std::vector<glm::vec3>& simulated_in_world_m,
                            const glm::dquat& world_from_head_rotation, const FollowedSkin& skin,
                            std::vector<glm::vec3>& all_in_world_m) {
  const glm::dmat3 world_from_head = glm::mat3_cast(world_from_head_rotation);
  turn(glm::transpose(world_from_head), simulated_in_world_m, simulated_in_head_m_);
  vertices_->follow(simulated_in_head_m_, guides_m_);
  follow_->follow(guides_m_, all_in_head_m_, skin);
  all_in_world_m.resize(all_in_head_m_.size());
  turn(world_from_head, all_in_head_m_, all_in_world_m);
  put_simulated(simulated_in_world_m, all_in_world_m);
}

/// What is simulated is where it was, to the last bit.
void FollowedSolver::put_simulated(std::span<const glm::vec3> simulated, std::span<glm::vec3> all) const {
  const uint32_t count = follow_->guide_count();
  for (size_t k = 0; k < vertices_->kept().size(); ++k)
    std::copy_n(simulated.data() + k * count, count,
                all.data() + size_t{vertices_->kept()[k]} * follow_->strand_count());
}

void FollowedSolver::follow_guides() {
  if (is_followed_) return;
  guides_->read(simulated_);
  expand(simulated_.position_m, world_from_head_rotation_, skin_, all_.position_m);
  vertices_->blend(simulated_.velocity_mps, guides_m_);
  follow_->blend(guides_m_, all_.velocity_mps);
  pack_blocks(all_.position_m, position_blocks_);
  pack_blocks(all_.velocity_mps, velocity_blocks_);
  is_followed_ = true;
}

SolverBlocks FollowedSolver::read_blocks() {
  follow_guides();
  return {position_blocks_.view(), velocity_blocks_.view()};
}

// Seen from the head joint strands are looked at once more a little later: what they have moved by is their
// velocity, beside the head's. Both looks are without the skin: to which side of it a strand is turned may
// change from one to the other, and that is no motion.
void FollowedSolver::read(SolverState& state) {
  guides_->read(simulated_);
  expand(simulated_.position_m, world_from_head_rotation_, skin_, state.position_m);
  expand(simulated_.position_m, world_from_head_rotation_, {}, free_m_);
  const glm::vec3 head_velocity(head_velocity_mps_), head_spin(head_spin_radps_);
  const size_t pinned = size_t{follow_->pinned_count()} * follow_->guide_count();
  std::vector<glm::vec3> ahead(simulated_.position_m);
  for (size_t i = 0; i < ahead.size(); ++i) {
    const glm::vec3 relative =
        i < pinned ? glm::cross(head_spin, ahead[i]) : simulated_.velocity_mps[i] - head_velocity;
    ahead[i] += kAheadS * relative;
  }
  const double spin = glm::length(head_spin_radps_);
  const glm::dquat turn_ahead =
      spin > 0.0 ? glm::angleAxis(spin * kAheadS, head_spin_radps_ / spin) : glm::dquat(1.0, 0.0, 0.0, 0.0);
  expand(ahead, turn_ahead * world_from_head_rotation_, {}, state.velocity_mps);
  for (size_t i = 0; i < state.velocity_mps.size(); ++i)
    state.velocity_mps[i] = head_velocity + (state.velocity_mps[i] - free_m_[i]) / kAheadS;
  put_simulated(simulated_.velocity_mps, state.velocity_mps);
  is_followed_ = false;
}

void FollowedSolver::write(const SolverState& state) {
  const auto take = [&](std::span<const glm::vec3> all, std::vector<glm::vec3>& simulated) {
    take_first(all, follow_->strand_count(), follow_->guide_count(), guides_m_);
    simulated.resize(vertices_->kept_size());
    vertices_->take(guides_m_, simulated);
  };
  take(state.position_m, simulated_.position_m);
  take(state.velocity_mps, simulated_.velocity_mps);
  guides_->write(simulated_);
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
  const size_t vectors = simulated_in_head_m_.size() + guides_m_.size() + all_in_head_m_.size() +
                         all_.position_m.size() + all_.velocity_mps.size();
  return guides_->memory_bytes() + vertices_->size_bytes() + follow_->size_bytes() +
         vectors * sizeof(glm::vec3) + (position_blocks_.size() + velocity_blocks_.size()) * sizeof(float);
}

}  // namespace strandcast

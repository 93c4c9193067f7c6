#include "server/publish/publisher.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"

namespace strandcast {
namespace {

// Comparisons with a NaN are false, so this also refuses what is not finite.
bool is_usable_position(const glm::vec3& point) {
  return std::abs(point.x) <= kMaxStrandReachM && std::abs(point.y) <= kMaxStrandReachM &&
         std::abs(point.z) <= kMaxStrandReachM;
}

bool is_usable_velocity(const glm::vec3& velocity) {
  return std::isfinite(velocity.x) && std::isfinite(velocity.y) && std::isfinite(velocity.z);
}

}  // namespace

Publisher::Publisher(const Groom& groom, float bound_m)
    : strand_count_(groom.strand_count()),
      vertex_count_(groom.uniform_vertex_count()),
      quantum_m_(quantum_for_bound(bound_m)) {
  CHECK(strand_count_ > 0 && vertex_count_ > 0);
  const size_t plane_size = static_cast<size_t>(strand_count_) * vertex_count_;
  rest_position_m_.resize(plane_size);
  position_in_head_m_.resize(plane_size);
  is_broken_.resize(strand_count_);
  quarantined_.reserve(strand_count_);
  for (uint32_t strand = 0; strand < strand_count_; ++strand)
    for (uint32_t vertex = 0; vertex < vertex_count_; ++vertex)
      rest_position_m_[static_cast<size_t>(vertex) * strand_count_ + strand] =
          groom.rest_position_m[groom.offset[strand] + vertex];
}

std::shared_ptr<const Snapshot> Publisher::publish(Solver& solver, const PublishInput& input) {
  {
    const ScopedStage stage(read_timer_);
    solver.read(state_);
  }
  CHECK(state_.position_m.size() == rest_position_m_.size());
  CHECK(state_.velocity_mps.size() == rest_position_m_.size());
  const ScopedStage stage(quantise_timer_);
  find_broken_strands();
  const glm::dmat3 world_from_head = glm::mat3_cast(input.world_from_head.rotation);
  for (const uint32_t strand : quarantined_) put_to_rest(strand, world_from_head);

  // In double, so that the one rounding to float is all that is added to the announced bound.
  const glm::dmat3 head_from_world = glm::transpose(world_from_head);
  for (size_t i = 0; i < position_in_head_m_.size(); ++i)
    position_in_head_m_[i] = glm::vec3(head_from_world * glm::dvec3(state_.position_m[i]));

  QuantiseInput quantise_input;
  quantise_input.tick = input.tick;
  quantise_input.sim_time_ns = input.sim_time_ns;
  quantise_input.motion_time_ns = input.motion_time_ns;
  quantise_input.world_from_head = input.world_from_head;
  quantise_input.strand_count = strand_count_;
  quantise_input.vertex_count = vertex_count_;
  quantise_input.quantum_m = quantum_m_;
  quantise_input.position_in_head_m = position_in_head_m_;
  quantise_input.fallback_m = rest_position_m_;
  return std::make_shared<const Snapshot>(quantise(quantise_input).snapshot);
}

void Publisher::find_broken_strands() {
  uint64_t bad_vertices = 0;
  const size_t plane_size = rest_position_m_.size();
  for (size_t i = 0; i < plane_size; ++i)
    bad_vertices +=
        is_usable_position(state_.position_m[i]) && is_usable_velocity(state_.velocity_mps[i]) ? 0 : 1;
  quarantined_.clear();
  if (bad_vertices == 0) return;

  std::fill(is_broken_.begin(), is_broken_.end(), uint8_t{0});
  for (size_t i = 0; i < plane_size; ++i)
    if (!is_usable_position(state_.position_m[i]) || !is_usable_velocity(state_.velocity_mps[i]))
      is_broken_[i % strand_count_] = 1;
  for (uint32_t strand = 0; strand < strand_count_; ++strand)
    if (is_broken_[strand] != 0) quarantined_.push_back(strand);
  bad_vertex_count_ += bad_vertices;
  quarantine_count_ += quarantined_.size();
}

void Publisher::put_to_rest(uint32_t strand_index, const glm::dmat3& world_from_head) {
  for (uint32_t vertex = 0; vertex < vertex_count_; ++vertex) {
    const size_t i = static_cast<size_t>(vertex) * strand_count_ + strand_index;
    state_.position_m[i] = glm::vec3(world_from_head * glm::dvec3(rest_position_m_[i]));
    state_.velocity_mps[i] = glm::vec3(0.0f);
  }
}

void Publisher::repair(Solver& solver) {
  solver.write(state_);
}

}  // namespace strandcast

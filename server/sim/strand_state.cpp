#include "server/sim/strand_state.h"

#include <algorithm>

#include "common/base/check.h"

namespace strandcast {
namespace {

void copy_vectors(const std::vector<glm::vec4>& from, std::vector<glm::vec3>& to) {
  to.resize(from.size());
  std::transform(from.begin(), from.end(), to.begin(), [](const glm::vec4& v) { return glm::vec3(v); });
}

}  // namespace

Status StrandState::load(const Groom& groom, const glm::dquat& world_from_head_rotation) {
  ASSIGN_OR_RETURN(StrandLayout layout, make_strand_layout(groom));
  RETURN_IF_ERROR(executor_.check_size(layout));
  head_ = HeadPath::at_rest(world_from_head_rotation);
  is_at_rest_ = true;
  const uint32_t strand_count = layout.strand_count;
  rest_ = executor_.make_plane("strand rest", strand_count, layout.rest);
  staging_.resize(layout.size());
  for (size_t i = 0; i < staging_.size(); ++i) {
    const glm::dvec3 position = head_.world_from_head_rotation * glm::dvec3(layout.rest[i]);
    staging_[i] = glm::vec4(glm::vec3(position), layout.arc[i]);
  }
  position_ = executor_.make_plane("strand position", strand_count, staging_);
  std::fill(staging_.begin(), staging_.end(), glm::vec4(0.0f));
  velocity_ = executor_.make_plane("strand velocity", strand_count, staging_);
  layout.arc = {};
  layout_ = std::move(layout);
  return {};
}

BoundPlanes StrandState::planes() const {
  BoundPlanes planes{};
  plane_of(planes, PlaneRole::Rest) = rest_.get();
  plane_of(planes, PlaneRole::Position) = position_.get();
  plane_of(planes, PlaneRole::Velocity) = velocity_.get();
  return planes;
}

void StrandState::advance(const StepInput& input) {
  head_.advance(input);
  is_at_rest_ = false;
}

void StrandState::read(SolverState& state) {
  position_->read(staging_);
  copy_vectors(staging_, state.position_m);
  velocity_->read(staging_);
  copy_vectors(staging_, state.velocity_mps);
}

StrandBlocksView StrandState::blocks_of(const StrandPlane& plane, StrandBlocks& blocks) {
  if (const auto view = plane.view()) return *view;
  plane.read(staging_);
  if (blocks.strand_count() != layout_.strand_count || blocks.row_count() != layout_.vertex_count)
    blocks = StrandBlocks(layout_.strand_count, layout_.vertex_count);
  pack_blocks(staging_, blocks);
  return blocks.view();
}

SolverBlocks StrandState::read_blocks() {
  return {blocks_of(*position_, position_blocks_), blocks_of(*velocity_, velocity_blocks_)};
}

std::vector<bool> StrandState::write(const SolverState& state) {
  CHECK(state.position_m.size() == layout_.size() && state.velocity_mps.size() == layout_.size());
  std::vector<bool> is_changed(layout_.strand_count, false);
  position_->read(staging_);  // keeps w
  for (size_t i = 0; i < staging_.size(); ++i) {
    if (glm::vec3(staging_[i]) != state.position_m[i]) is_changed[i % layout_.strand_count] = true;
    staging_[i] = glm::vec4(state.position_m[i], staging_[i].w);
  }
  position_->write(staging_);
  velocity_->read(staging_);
  for (size_t i = 0; i < staging_.size(); ++i) {
    if (glm::vec3(staging_[i]) != state.velocity_mps[i]) is_changed[i % layout_.strand_count] = true;
  }
  for (size_t i = 0; i < staging_.size(); ++i) {
    const float kept = is_changed[i % layout_.strand_count] ? 0.0f : staging_[i].w;
    staging_[i] = glm::vec4(state.velocity_mps[i], kept);
  }
  velocity_->write(staging_);
  is_at_rest_ = is_at_rest_ && std::count(is_changed.begin(), is_changed.end(), true) == 0;
  return is_changed;
}

void StrandState::forget_model() {
  write_model(std::vector<float>(layout_.size(), 0.0f));
}

void StrandState::write_model(const std::vector<float>& values) {
  CHECK(values.size() == layout_.size());
  velocity_->read(staging_);
  for (size_t i = 0; i < staging_.size(); ++i) staging_[i].w = values[i];
  velocity_->write(staging_);
}

glm::dquat StrandState::rebase(const glm::dquat& world_from_head_rotation) {
  const glm::dquat turn = head_.rebase(world_from_head_rotation);
  turn_plane(*position_, turn);
  turn_plane(*velocity_, turn);
  return turn;
}

uint64_t StrandState::memory_bytes() const {
  uint64_t bytes = 0;
  for (const auto* plane : {&rest_, &position_, &velocity_})
    if (*plane) bytes += (*plane)->size_bytes();
  return bytes;
}

}  // namespace strandcast

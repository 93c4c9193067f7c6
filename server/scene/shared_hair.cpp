#include "server/scene/shared_hair.h"

#include <cmath>
#include <utility>

#include "common/base/check.h"
#include "common/base/units.h"

namespace strandcast {

SolverState state_of(const SolverBlocks& blocks) {
  const auto unpacked = [](const StrandBlocksView& from) {
    std::vector<glm::vec3> values;
    values.reserve(size_t{from.row_count} * from.strand_count);
    for (uint32_t v = 0; v < from.row_count; ++v)
      for (uint32_t s = 0; s < from.strand_count; ++s) {
        const auto at = [&](uint32_t axis) {
          return from.row(s / kBlockStrands, v, axis)[s % kBlockStrands];
        };
        values.emplace_back(at(0), at(1), at(2));
      }
    return values;
  };
  return {unpacked(blocks.position_m), unpacked(blocks.velocity_mps)};
}

bool SharedHair::follow(SharedUpdate update, const StepTrail& trail, double step_rate_hz) {
  if (update.model == nullptr || update.model != trail.model || trail.scene == nullptr) return false;
  if (update.strands != nullptr) {
    strands_ = std::move(update.strands);
    model_ = update.model;
  }
  if (strands_ == nullptr || model_ != update.model || trail.ticks.empty() || update.state == nullptr)
    return false;
  const uint64_t now = trail.ticks.back().tick;
  if (update.tick < first_tick_ || update.tick > now || now - update.tick > trail.ticks.size()) return false;
  strands_->take(*update.state);
  number_ = update.number;
  for (const StepTick& tick : trail.ticks)
    if (tick.tick > update.tick) step(tick, *trail.scene, step_rate_hz);
  return true;
}

void SharedHair::step(const StepTick& tick, const StepScene& scene, double step_rate_hz) {
  CHECK(is_active());
  // As a snapshot of the tick says it.
  strands_->step(tick, scene, std::llround(static_cast<double>(tick.tick) / step_rate_hz * kNsPerS));
}

SolverBlocks SharedHair::read_blocks() {
  CHECK(is_active());
  if (position_m_.strand_count() != model_->strand_count || position_m_.row_count() != model_->vertex_count) {
    position_m_ = StrandBlocks(model_->strand_count, model_->vertex_count);
    velocity_mps_ = StrandBlocks(model_->strand_count, model_->vertex_count);
  }
  strands_->read(position_m_, velocity_mps_);
  return {position_m_.view(), velocity_mps_.view()};
}

void SharedHair::leave(Solver& solver, const glm::dquat& world_from_head_rotation, uint64_t tick) {
  if (is_active()) {
    solver.rebase(world_from_head_rotation);
    solver.write(state_of(read_blocks()));
  }
  drop(tick);
}

void SharedHair::drop(uint64_t tick) {
  number_ = 0;
  first_tick_ = tick + 1;
}

}  // namespace strandcast

#include "server/scene/step_log.h"

namespace strandcast {

void StepLog::set_scene(const StepScene& scene) {
  if (scene_ == nullptr || *scene_ != scene) scene_ = std::make_shared<StepScene>(scene);
}

void StepLog::add(const StepTick& tick) {
  if (!ticks_.empty() && ticks_.back().tick + 1 != tick.tick) ticks_.clear();
  if (ticks_.size() == kMostTrailTicks) ticks_.erase(ticks_.begin());
  ticks_.push_back(tick);
}

double StepLog::step_cost() const {
  if (model_ == nullptr) return 0.0;
  // What acts on strands besides, as measured beside dftl.
  constexpr double kBendCost = 1.0, kDragCost = 0.5, kBodyCost = 1.0, kFieldCost = 4.0;
  double cost = find_step_kernel(model_->kernel.shader_path)->cost;
  if (model_->bend) cost += kBendCost;
  if (model_->drag_along_share != 1.0) cost += kDragCost;
  if (model_->meets_body) cost += kBodyCost;
  if (model_->field != nullptr) cost += kFieldCost;
  if (!tells_volume(*model_)) return cost;
  // The volume once a step, what it does to each vertex in each substep.
  constexpr double kVolumeCost = 12.0;
  constexpr double kForcesCost = 2.0;
  return cost + kForcesCost + kVolumeCost / (scene_ == nullptr ? 1.0 : scene_->substeps);
}

std::shared_ptr<const StepTrail> StepLog::trail(uint64_t shared) const {
  if (model_ == nullptr || scene_ == nullptr) return nullptr;
  return std::make_shared<StepTrail>(StepTrail{model_, scene_, ticks_, shared});
}

}  // namespace strandcast

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
  return model_ == nullptr ? 0.0 : find_step_kernel(model_->kernel.shader_path)->cost;
}

std::shared_ptr<const StepTrail> StepLog::trail() const {
  if (model_ == nullptr || scene_ == nullptr) return nullptr;
  return std::make_shared<StepTrail>(StepTrail{model_, scene_, ticks_});
}

}  // namespace strandcast

// StepLog: inputs of the last steps, which snapshots carry (StepTrail). Simulation thread.
#pragma once

#include <memory>
#include <vector>

#include "common/kernels/step_model.h"

namespace strandcast {

class StepLog {
 public:
  /// Sets the model of the steps; nullptr if nobody else can simulate them.
  void set_model(std::shared_ptr<const StepModel> model) { model_ = std::move(model); }
  /// Sets the scene of the steps from now on.
  void set_scene(const StepScene& scene);
  void add(const StepTick& tick);
  /// Returns StepKernel::cost of the model; 0 without one.
  double step_cost() const;
  /// Returns the current trail, with StepTrail::shared; nullptr while there is no model.
  std::shared_ptr<const StepTrail> trail(uint64_t shared = 0) const;

 private:
  std::shared_ptr<const StepModel> model_;
  std::shared_ptr<const StepScene> scene_;
  std::vector<StepTick> ticks_;
};

}  // namespace strandcast

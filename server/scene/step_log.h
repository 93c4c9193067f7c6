// StepLog: what the last steps were made of, for snapshots to carry (StepTrail). Simulation thread.
#pragma once

#include <memory>
#include <vector>

#include "common/kernels/step_model.h"

namespace strandcast {

class StepLog {
 public:
  /// nullptr: nobody else can take the steps.
  void set_model(std::shared_ptr<const StepModel> model) { model_ = std::move(model); }
  /// The scene of the steps from now on.
  void set_scene(const StepScene& scene);
  void add(const StepTick& tick);
  /// StepKernel::cost of the model; 0 without one.
  double step_cost() const;
  /// As it is now; nullptr while there is no model.
  std::shared_ptr<const StepTrail> trail() const;

 private:
  std::shared_ptr<const StepModel> model_;
  std::shared_ptr<const StepScene> scene_;
  std::vector<StepTick> ticks_;
};

}  // namespace strandcast

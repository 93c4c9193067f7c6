// SharedSteps: SharedStrands by the predictor that encoder and decoders of the codec "step" have. Private to
// common/strands.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/strands/shared_strands.h"
#include "common/strands/step/predictor.h"
#include "common/strands/step/wire.h"

namespace strandcast::step {

class PredictedState final : public SharedState {
 public:
  Predictor::State state;
  TickBase base;
  tangent::Planes<int32_t> lattice;  // decoded positions
  float quantum_m = 0.0f;
};

class SharedSteps final : public SharedStrands {
 public:
  /// Makes strands of a model as told on the wire. Call take() before the first step. Fails as
  /// Predictor::make().
  static Result<std::shared_ptr<SharedSteps>> make(StepModel model, std::span<const glm::vec3> rest_in_head_m,
                                                   WorkerPool& workers, simd::InstructionSet set);
  void take(const SharedState& state) override;
  void step(const StepTick& tick, const StepScene& scene, int64_t end_time_ns) override;
  void read(StrandBlocks& position_m, StrandBlocks& velocity_mps) const override;

 private:
  explicit SharedSteps(std::span<const glm::vec3> rest_in_head_m)
      : rest_in_head_m_(rest_in_head_m.begin(), rest_in_head_m.end()) {}

  const std::vector<glm::vec3> rest_in_head_m_;
  tangent::Layout layout_;
  std::unique_ptr<Predictor> predictor_;
  StepScene scene_;
  StepScene told_scene_;  // rounded, as viewers read it
  bool has_scene_ = false;
  PredictedState now_;  // its base, lattice and quantum
};

}  // namespace strandcast::step

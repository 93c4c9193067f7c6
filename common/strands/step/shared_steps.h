// SharedSteps: SharedStrands by the predictor that encoder and decoders of the codec "step" have. Private to
// common/strands.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <mutex>
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
  /// Decoded positions. An encoder that receives the state moves them out of it, since it is their only
  /// user.
  mutable tangent::Planes<int32_t> lattice;
  float quantum_m = 0.0f;
  uint64_t tick = 0;
  uint64_t told = 0;  // hash of all that acted since an encoder's update, as viewers are told it
};

/// Copies of states, whose memory is used again. Copies may be dropped on any thread, later too.
class StateCopies {
 public:
  /// Returns a copy of a state of strands; the rest is the caller's to fill in.
  std::shared_ptr<PredictedState> make(const Predictor::State& state);

 private:
  struct Dropped {
    std::mutex mutex;
    std::vector<std::unique_ptr<PredictedState>> states;
  };
  std::shared_ptr<Dropped> dropped_ = std::make_shared<Dropped>();
};

/// What acts in one step: the hash of its scene's bytes, those of its tick.
struct ToldStep {
  uint64_t scene = 0;
  std::span<const std::byte> tick;
  Pose world_from_head;
  int64_t end_time_ns = 0;
};
/// Returns PredictedState::told after the step.
uint64_t told_after(uint64_t before, const ToldStep& step);
/// Returns it for a state of this moment, which nothing has followed yet.
uint64_t told_from(const Moment& moment);

class SharedSteps final : public SharedStrands {
 public:
  /// Makes strands of a model as told on the wire. Call take() before the first step. Fails as
  /// Predictor::make().
  static Result<std::shared_ptr<SharedSteps>> make(StepModel model, std::span<const glm::vec3> rest_in_head_m,
                                                   WorkerPool& workers, simd::InstructionSet set);
  void take(const SharedState& state) override;
  void step(const StepTick& tick, const StepScene& scene, int64_t end_time_ns) override;
  std::shared_ptr<const SharedState> state() override;
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
  uint64_t scene_hash_ = 0;  // of its bytes
  PredictedState now_;       // all but its strands
  StateCopies copies_;
};

}  // namespace strandcast::step

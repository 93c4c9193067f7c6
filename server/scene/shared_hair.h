// SharedHair: strands that the simulation steps as its viewers do, from the state that they have. A solver of
// the same model steps them whenever that is not possible. Simulation thread.
#pragma once

#include <memory>

#include "common/kernels/step_model.h"
#include "common/strands/shared_strands.h"
#include "server/sim/solver.h"

namespace strandcast {

/// Copies blocks out, as Solver::read() does.
SolverState state_of(const SolverBlocks& blocks);

class SharedHair {
 public:
  /// Returns whether strands are stepped here and not by the solver.
  bool is_active() const { return number_ != 0; }
  /// Returns SharedUpdate::number of the state that they go on from; 0 = none.
  uint64_t number() const { return number_; }
  /// Continues from the viewers' state, with the steps of `trail` after it. `step_rate_hz` as in step().
  /// Returns false and changes no strands if the model is another one, there is no state, or it is too old
  /// or from before leave() or drop().
  bool follow(SharedUpdate update, const StepTrail& trail, double step_rate_hz);
  /// Simulates a step of the announced model; needs is_active().
  void step(const StepTick& tick, const StepScene& scene, double step_rate_hz);
  /// Returns a copy of their state, for encoders; needs is_active().
  std::shared_ptr<const SharedState> state() const { return strands_->state(); }
  /// Returns the strands; valid until the next call.
  SolverBlocks read_blocks();
  /// Hands the strands to the solver that goes on with them at this tick, under this rotation of the head.
  void leave(Solver& solver, const glm::dquat& world_from_head_rotation, uint64_t tick);
  /// Forgets the strands; from this tick on the solver has others.
  void drop(uint64_t tick);

 private:
  std::shared_ptr<SharedStrands> strands_;
  std::shared_ptr<const StepModel> model_;  // of strands_
  uint64_t number_ = 0;
  uint64_t first_tick_ = 0;  // states of earlier ones are those of other strands
  StrandBlocks position_m_;
  StrandBlocks velocity_mps_;
};

}  // namespace strandcast

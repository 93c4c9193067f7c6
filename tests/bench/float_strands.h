// Serial Dynamic Follow-The-Leader as a plain float loop on one CPU thread: what a person would write first,
// to compare the GPU kernel with. Free tips only, no gust waves.
#pragma once

#include <vector>

#include "common/kernels/step_input.h"
#include "server/sim/solver.h"
#include "server/sim/strand_layout.h"

namespace strandcast {

class FloatStrands final : public Solver {
 public:
  explicit FloatStrands(const StrandParameters& parameters) : parameters_(parameters) {}
  Status load(const Groom& groom, const glm::dquat& world_from_head_rotation) override;
  void substep(const StepInput& input) override;
  void read(SolverState& state) override;
  void write(const SolverState& state) override;
  void rebase(const glm::dquat& world_from_head_rotation) override;
  uint32_t strand_count() const override { return layout_.strand_count; }
  uint64_t memory_bytes() const override;

 private:
  void step_strand(const StepBlock& block, const glm::mat3& rotation, uint32_t collider_count,
                   uint32_t strand);

  StrandParameters parameters_;
  StrandLayout layout_;
  SolverState state_;
  glm::dquat previous_rotation_{1.0, 0.0, 0.0, 0.0};
};

}  // namespace strandcast

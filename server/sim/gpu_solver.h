// GpuSolver: what solvers on the GPU share around their kernels: the strands' state, the step's block, load,
// read, write and rebase. A model says how to prepare and run its kernel, and what it keeps beside the state.
// From one thread with its GL context current.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/gl/objects.h"
#include "server/sim/follicle_limit.h"
#include "server/sim/solver_registry.h"
#include "server/sim/step_block.h"
#include "server/sim/strand_programs.h"
#include "server/sim/strand_state.h"

namespace strandcast {

class GpuSolver : public Solver {
 public:
  Status load(const Groom& groom, const glm::dquat& world_from_head_rotation) final;
  void substep(const StepInput& input) final;
  void read(SolverState& state) final { strands_->read(state); }
  void write(const SolverState& state) final;
  void rebase(const glm::dquat& world_from_head_rotation) final;
  uint32_t strand_count() const final { return strands_->layout().strand_count; }
  uint64_t memory_bytes() const final;
  const StrandState* strands() const final { return strands_.get(); }
  Status follow() final;

 protected:
  GpuSolver(const GpuSolverContext& context, const StrandParameters& parameters);

  /// The strands are known: compiles and allocates. Changes nothing of the state, also when it fails.
  virtual Status prepare() = 0;
  /// Starts without a history from the strands as they are, after prepare().
  virtual void begin() {}
  /// Runs the kernels; state and step block are bound, barriers are set afterwards.
  virtual void run(const gl::Program& program) = 0;
  /// Before a substep, for what depends on its input.
  virtual void adapt(const StepInput&) {}
  /// Strands that somebody else moved start without a history.
  virtual void forget(const std::vector<bool>&) {}
  /// What is kept beside the state of where vertices were and how segments are turned, to go along when a
  /// substep's strands are moved once more.
  virtual CarriedPlanes carried() const { return {}; }
  /// What is kept beside the state turns with it.
  virtual void turn_memory(const glm::dquat&) {}
  virtual const StrandPrograms& programs() const = 0;
  virtual uint64_t model_bytes() const = 0;

  const StrandLayout& layout() const { return strands_->layout(); }
  StrandState& state() { return *strands_; }
  const StrandState& state() const { return *strands_; }
  const SceneFeatures& features() const { return features_; }
  const gl::ShaderLibrary& shaders() const { return shaders_; }

 private:
  Status prepare_all();

  std::shared_ptr<StrandState> strands_;
  StrandParameters parameters_;
  SceneFeatures features_;
  gl::ShaderLibrary shaders_;
  std::optional<FollicleLimit> follicle_limit_;  // where the scene has one
  gl::Buffer step_;                              // StepBlock
};

}  // namespace strandcast

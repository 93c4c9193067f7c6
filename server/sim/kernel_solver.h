// KernelSolver: what solvers with a kernel share around it: the strands' state, the step's block, load, read,
// write and rebase. A model says what its kernel is, and what it keeps beside the state. From the thread of
// its executor.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/kernels/step_block.h"
#include "server/sim/bend_limit.h"
#include "server/sim/body_collider.h"
#include "server/sim/field_collider.h"
#include "server/sim/follicle_limit.h"
#include "server/sim/oriented_drag.h"
#include "server/sim/solver_registry.h"
#include "server/sim/strand_state.h"
#include "server/sim/volume/volume_forces.h"

namespace strandcast {

class KernelSolver : public Solver {
 public:
  Status load(const Groom& groom, const glm::dquat& world_from_head_rotation) final;
  void gather(const StepInput& input) final;
  void substep(const StepInput& input) final;
  void read(SolverState& state) final { strands_->read(state); }
  SolverBlocks read_blocks() final { return strands_->read_blocks(); }
  void write(const SolverState& state) final;
  void rebase(const glm::dquat& world_from_head_rotation) final;
  uint32_t strand_count() const final { return layout().strand_count; }
  uint64_t memory_bytes() const final;
  std::shared_ptr<const StepModel> step_model() final;
  const StrandState* strands() const final { return strands_.get(); }
  Status follow() final;

 protected:
  KernelSolver(const SolverContext& context, const StrandParameters& parameters);

  /// The strands are known: allocates. Changes nothing of the state.
  virtual void prepare() {}
  /// For the strands as they are, after prepare().
  virtual KernelDesc kernel() const = 0;
  /// Starts without a history from the strands as they are, when the kernel is compiled.
  virtual void begin() {}
  /// Puts in the planes that the model keeps beside the state, as far as its kernel touches them.
  virtual void bind(BoundPlanes&) const {}
  /// Before a substep, for what depends on its input.
  virtual void adapt(const StepInput&) {}
  /// Strands that somebody else moved start without a history.
  virtual void forget(const std::vector<bool>&) {}
  /// What is kept beside the state of where vertices were and how segments are turned, to go along when a
  /// substep's strands are moved once more.
  virtual CarriedPlanes carried() const { return {}; }
  /// What is kept beside the state turns with it.
  virtual void turn_memory(const glm::dquat&) {}
  virtual uint64_t model_bytes() const { return 0; }

  const StrandLayout& layout() const { return strands_->layout(); }
  StrandState& state() { return *strands_; }
  const StrandState& state() const { return *strands_; }
  /// (rows x strand_count) values.
  std::unique_ptr<StrandPlane> make_plane(const std::string& label, std::span<const glm::vec4> values) const {
    return executor_.make_plane(label, layout().strand_count, values);
  }

 private:
  Status prepare_all();

  Executor& executor_;
  std::shared_ptr<StrandState> strands_;
  StrandParameters parameters_;
  SceneFeatures features_;
  std::unique_ptr<KernelProgram> program_;
  std::optional<FollicleLimit> follicle_limit_;  // where the scene has one
  VolumeDesc volume_;
  std::shared_ptr<const Groom> volume_target_;
  std::unique_ptr<VolumeForces> volume_forces_;  // where hair acts on hair
  bool has_gathered_ = false;                    // for the step that comes
  double drag_along_share_;
  std::optional<OrientedDrag> oriented_drag_;  // where the scene's air has one
  BendLimitDesc bend_limits_;
  std::optional<BendLimit> bend_limit_;        // where the scene has one
  std::optional<BodyCollider> body_collider_;  // where the scene has a body
  std::shared_ptr<const DistanceField> head_field_;
  std::optional<FieldCollider> field_collider_;  // where the scene's head collides as a field
};

}  // namespace strandcast

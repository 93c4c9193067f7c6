// KernelSolver: common part of the solvers with a kernel: state of the strands, uniform block of a step,
// load, read, write and rebase. A model provides its kernel and its data besides the state. Runs on its
// executor's thread.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/kernels/step_input.h"
#include "server/sim/bend_limit.h"
#include "server/sim/body_collider.h"
#include "server/sim/field_collider.h"
#include "server/sim/follicle_limit.h"
#include "server/sim/mixed_tips.h"
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

  /// Allocates the model's data once the strands are known; must not change the state.
  virtual void prepare() {}
  /// Returns the kernel for the strands in their present state; called after prepare().
  virtual KernelDesc kernel() const = 0;
  /// Starts without a history from the present strands, after the kernel was compiled.
  virtual void begin() {}
  /// Adds the model's own planes, as far as its kernel uses them.
  virtual void bind(BoundPlanes&) const {}
  /// Adapts the model to the input of the coming substep.
  virtual void adapt(const StepInput&) {}
  /// Clears the history of strands that were moved from outside.
  virtual void forget(const std::vector<bool>&) {}
  /// Returns the model's planes of earlier positions and of segment orientations. A pass that moves strands
  /// must update these too.
  virtual CarriedPlanes carried() const { return {}; }
  /// Rotates the model's data along with the state.
  virtual void turn_memory(const glm::dquat&) {}
  virtual uint64_t model_bytes() const { return 0; }

  const StrandLayout& layout() const { return strands_->layout(); }
  StrandState& state() { return *strands_; }
  const StrandState& state() const { return *strands_; }
  /// Makes a plane with (rows x strand_count) values.
  std::unique_ptr<StrandPlane> make_plane(const std::string& label, std::span<const glm::vec4> values) const {
    return executor_.make_plane(label, layout().strand_count, values);
  }

 private:
  Status prepare_all();
  /// Prepares what strands of two kinds need.
  Status prepare_mixed(const SceneFeatures& of_model);
  /// Returns the planes that kernels write.
  BoundPlanes moving() const;
  /// Runs a substep's kernels for strands of this kind.
  void run(const StepInput& input, Tips tips, KernelProgram& program);

  Executor& executor_;
  std::shared_ptr<StrandState> strands_;
  StrandParameters parameters_;
  SceneFeatures features_;
  std::unique_ptr<KernelProgram> program_;
  // Where strands of both kinds are: program_ is that of pinned tips.
  std::unique_ptr<KernelProgram> free_tips_program_;
  std::optional<MixedTips> mixed_tips_;
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

/// Properties that distinguish one kernel from another.
struct StrandKernelDesc {
  std::string name;            // labels
  std::string shader_path;     // below shaders/
  bool is_per_vertex = false;  // as KernelDesc
  bool has_offset = false;     // a strand beside the state; one that is written starts without any
  ModelConstants constants;
};

class StrandKernel final : public KernelSolver {
 public:
  static std::unique_ptr<Solver> make(StrandKernelDesc desc, const StrandParameters& parameters,
                                      const SolverContext& context) {
    return std::unique_ptr<Solver>(new StrandKernel(std::move(desc), parameters, context));
  }

 private:
  StrandKernel(StrandKernelDesc desc, const StrandParameters& parameters, const SolverContext& context)
      : KernelSolver(context, parameters), desc_(std::move(desc)) {}

  void prepare() override;
  KernelDesc kernel() const override;
  void bind(BoundPlanes& planes) const override;
  void forget(const std::vector<bool>& is_changed) override;
  void turn_memory(const glm::dquat& turn) override;
  uint64_t model_bytes() const override { return offset_ ? offset_->size_bytes() : 0; }

  StrandKernelDesc desc_;
  // (vertex_count x strand_count) second strand less the state, m; has_offset only
  std::unique_ptr<StrandPlane> offset_;
};

}  // namespace strandcast

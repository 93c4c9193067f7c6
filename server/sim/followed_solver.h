// FollowedSolver: a solver of the first strands that gives all of them: the others follow (StrandFollow) when
// somebody reads, and take no step. From the thread of the solver that it has.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "server/sim/solver.h"
#include "server/sim/strand_follow.h"

namespace strandcast {

class FollowedSolver : public Solver {
 public:
  /// `guides` has strands of its own. `share` of the strands are simulated, in (0, 1].
  FollowedSolver(std::unique_ptr<Solver> guides, double share) : guides_(std::move(guides)), share_(share) {}

  Status load(const Groom& groom, const glm::dquat& world_from_head_rotation) override;
  void substep(const StepInput& input) override;
  void gather(const StepInput& input) override { guides_->gather(input); }
  void follow_guides() override;
  /// Velocities of the strands that follow: how they go on while the guides move as they do.
  void read(SolverState& state) override;
  /// Their velocities are the mean of their guides'.
  SolverBlocks read_blocks() override;
  /// Of the first strands; the others follow them from here on.
  void write(const SolverState& state) override;
  void rebase(const glm::dquat& world_from_head_rotation) override;
  uint32_t strand_count() const override { return follow_ ? follow_->strand_count() : 0; }
  uint32_t guide_count() const { return follow_ ? follow_->guide_count() : 0; }
  uint64_t memory_bytes() const override;

 private:
  void expand(const std::vector<glm::vec3>& guides_in_world_m, const glm::dquat& world_from_head_rotation,
              std::vector<glm::vec3>& all_in_world_m);

  std::unique_ptr<Solver> guides_;
  const double share_;
  std::optional<StrandFollow> follow_;
  glm::dquat world_from_head_rotation_{1.0, 0.0, 0.0, 0.0};
  // Of the head in the newest substep, world: what roots move with.
  glm::dvec3 head_velocity_mps_{0.0};
  glm::dvec3 head_spin_radps_{0.0};
  bool is_followed_ = false;  // all_ and the blocks are of the guides as they are
  SolverState of_guides_;
  SolverState all_;
  std::vector<glm::vec3> in_head_m_;
  StrandBlocks position_blocks_;
  StrandBlocks velocity_blocks_;
};

/// The groom with its first strands alone.
Groom first_strands(const Groom& groom, uint32_t count);

}  // namespace strandcast

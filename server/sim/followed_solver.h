// FollowedSolver: simulates a part of the hair with another solver: the first strands, or some vertices of
// each. The rest follows without simulation (StrandFollow, VertexFollow) and is computed when the state is
// read. Runs on the inner solver's thread.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "common/scene/features.h"
#include "server/sim/solver.h"
#include "server/sim/strand_follow.h"
#include "server/sim/vertex_follow.h"

namespace strandcast {

/// Part of the hair that is simulated.
struct SimulatedPart {
  double strand_share = 1.0;   // the first strands; in (0, 1]
  uint32_t vertex_stride = 1;  // every so many of a strand's vertices, at least 1

  bool is_all() const { return strand_share >= 1.0 && vertex_stride == 1; }
  bool operator==(const SimulatedPart&) const = default;
};

/// Returns the part that scene and facts call for; all of it if the groom's strands cannot follow others.
SimulatedPart simulated_part(const SceneDesc& scene, const RuntimeFacts& facts, const Groom& groom);
/// Returns the groom of the simulated part; `groom` must be uniform and satisfy can_follow().
Groom simulated_groom(const Groom& groom, const SimulatedPart& part);

class FollowedSolver : public Solver {
 public:
  /// Wraps `guides`, which must own its strands. `head_field` is what they collide with besides spheres;
  /// null: nothing.
  FollowedSolver(std::unique_ptr<Solver> guides, SimulatedPart part,
                 std::shared_ptr<const DistanceField> head_field = nullptr)
      : guides_(std::move(guides)), part_(part) {
    skin_.field = std::move(head_field);
  }

  Status load(const Groom& groom, const glm::dquat& world_from_head_rotation) override;
  void substep(const StepInput& input) override;
  void gather(const StepInput& input) override { guides_->gather(input); }
  void follow_guides() override;
  /// Copies out the state; following strands have the velocities of their present motion with the guides.
  void read(SolverState& state) override;
  /// Returns the state; the velocity of a following strand is the mean of its guides'.
  SolverBlocks read_blocks() override;
  /// Sets the first strands; the others follow them from then on.
  void write(const SolverState& state) override;
  void rebase(const glm::dquat& world_from_head_rotation) override;
  uint32_t strand_count() const override { return follow_ ? follow_->strand_count() : 0; }
  uint32_t guide_count() const { return follow_ ? follow_->guide_count() : 0; }
  /// Returns the number of simulated vertices of a strand.
  uint32_t simulated_vertices() const {
    return vertices_ ? static_cast<uint32_t>(vertices_->kept().size()) : 0;
  }
  uint64_t memory_bytes() const override;

 private:
  void expand(const std::vector<glm::vec3>& simulated_in_world_m, const glm::dquat& world_from_head_rotation,
              const FollowedSkin& skin, std::vector<glm::vec3>& all_in_world_m);

  void put_simulated(std::span<const glm::vec3> simulated, std::span<glm::vec3> all) const;

  std::unique_ptr<Solver> guides_;
  const SimulatedPart part_;
  std::optional<VertexFollow> vertices_;  // of the guides
  std::optional<StrandFollow> follow_;
  FollowedSkin skin_;  // as it was in the newest substep
  glm::dquat world_from_head_rotation_{1.0, 0.0, 0.0, 0.0};
  // Of the head in the newest substep, world: what roots move with.
  glm::dvec3 head_velocity_mps_{0.0};
  glm::dvec3 head_spin_radps_{0.0};
  bool is_followed_ = false;  // all_ and the blocks are of the guides as they are
  SolverState simulated_;
  SolverState all_;
  std::vector<glm::vec3> simulated_in_head_m_, guides_m_, all_in_head_m_, free_m_;
  StrandBlocks position_blocks_;
  StrandBlocks velocity_blocks_;
};

/// Returns a groom with the first `count` strands only.
Groom first_strands(const Groom& groom, uint32_t count);

}  // namespace strandcast

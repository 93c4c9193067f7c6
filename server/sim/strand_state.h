// StrandState: strands between two substeps where an executor keeps them: rest, position and velocity of
// every vertex, and how the head moved. It belongs to whoever runs the simulation; solvers are passes that
// read and write it, and one may follow another on the same state. It goes before its executor. From one
// thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <memory>
#include <vector>

#include "common/kernels/head_path.h"
#include "server/sim/executor/executor.h"
#include "server/sim/solver.h"
#include "server/sim/strand_layout.h"

namespace strandcast {

class StrandState {
 public:
  explicit StrandState(Executor& executor) : executor_(executor) {}
  /// Sets every strand to rest under the given head rotation; allocates. BadInput as make_strand_layout(),
  /// LimitExceeded when the executor's planes would be too small; the state is then as before.
  Status load(const Groom& groom, const glm::dquat& world_from_head_rotation);

  /// Counts, pinned vertices and rest lengths; `rest` of it as well, `arc` is in the planes only.
  const StrandLayout& layout() const { return layout_; }
  const HeadPath& head() const { return head_; }
  /// As loaded: nothing moved a strand since.
  bool is_at_rest() const { return is_at_rest_; }

  /// The planes that every kernel works on; the model's own are nullptr.
  BoundPlanes planes() const;
  /// The kernels of a substep are on their way.
  void advance(const StepInput& input);

  /// Copies the state out; resizes `state` on first use only.
  void read(SolverState& state);
  /// Positions with arc 0..1, velocities with what the model keeps beside them; as Solver::read_blocks().
  SolverBlocks read_blocks();
  /// Replaces positions and velocities. Returns which strands are not as they were: what a model keeps beside
  /// their velocity is 0 again.
  std::vector<bool> write(const SolverState& state);
  /// What the last model kept beside the velocities is 0 again.
  void forget_model();
  /// What the model keeps beside the velocity of every vertex, (vertex_count x strand_count).
  void write_model(const std::vector<float>& values);
  /// The head has jumped to this rotation; strands jump along and are in head space what they were. Returns
  /// the turn.
  glm::dquat rebase(const glm::dquat& world_from_head_rotation);

  uint64_t memory_bytes() const;

 private:
  StrandBlocksView blocks_of(const StrandPlane& plane, StrandBlocks& blocks);

  Executor& executor_;
  StrandLayout layout_;
  HeadPath head_;
  bool is_at_rest_ = true;
  std::unique_ptr<StrandPlane> rest_;  // (vertex_count x strand_count) head space, m; segment before it, m
  std::unique_ptr<StrandPlane> position_;  // (vertex_count x strand_count) head-relative world, m; arc 0..1
  std::unique_ptr<StrandPlane>
      velocity_;  // (vertex_count x strand_count) world, m/s; of the model, 0 at first
  std::vector<glm::vec4> staging_;
  // Of read_blocks(), where planes are not kept in blocks.
  StrandBlocks position_blocks_;
  StrandBlocks velocity_blocks_;
};

}  // namespace strandcast

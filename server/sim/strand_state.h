// StrandState: state of the strands between substeps in an executor: rest, position and velocity of every
// vertex, and the head's motion. It belongs to the owner of the simulation. Solvers are passes that read and
// write it, and one may succeed another on the same state. It must be destroyed before its executor. One
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
  /// LimitExceeded if the executor's planes are too small. After an error the state is unchanged.
  Status load(const Groom& groom, const glm::dquat& world_from_head_rotation);

  /// Returns counts, pinned vertices, rest lengths and `rest`; `arc` is stored in the planes only.
  const StrandLayout& layout() const { return layout_; }
  const HeadPath& head() const { return head_; }
  /// Returns whether no strand has moved since the groom was loaded.
  bool is_at_rest() const { return is_at_rest_; }

  /// Returns the planes that every kernel uses; the model's own are nullptr.
  BoundPlanes planes() const;
  /// Notes that the kernels of a substep were started.
  void advance(const StepInput& input);

  /// Copies the state out; resizes `state` only on first use.
  void read(SolverState& state);
  /// Returns positions with arc 0..1 in w, and velocities with the model's value in w; as
  /// Solver::read_blocks().
  SolverBlocks read_blocks();
  /// Replaces positions and velocities. Returns which strands have changed; the model's values of these are
  /// reset to 0.
  std::vector<bool> write(const SolverState& state);
  /// Resets to 0 the values that the last model stored beside the velocities.
  void forget_model();
  /// Sets the model's value beside the velocity of every vertex, (vertex_count x strand_count).
  void write_model(const std::vector<float>& values);
  /// Rotates the strands with a head that jumped to this rotation; in head space nothing changes. Returns the
  /// rotation applied.
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

// Solver: one strand model behind a small interface; the table in solver_registry.h lists all of them. A
// solver is used from one thread, that of its executor if it has one. A solver never allocates in
// substep().
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/groom/groom.h"
#include "common/kernels/step_input.h"
#include "common/kernels/step_model.h"
#include "common/kernels/strand_blocks.h"
#include "common/math/pose.h"
#include "common/scene/features.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

/// State as read back, head-relative world axes. (vertex_count x strand_count) vertex-major, strand fastest.
struct SolverState {
  std::vector<glm::vec3> position_m;
  std::vector<glm::vec3> velocity_mps;
};

/// The same to be read where it lies, or where it was put: rows are vertices. w is the solver's own.
struct SolverBlocks {
  StrandBlocksView position_m;
  StrandBlocksView velocity_mps;
};

using SolverParameters = std::map<std::string, double>;

class StrandState;

class Solver {
 public:
  virtual ~Solver() = default;
  /// Sets every strand to rest under the given head rotation; allocates. `groom` is uniform.
  virtual Status load(const Groom& groom, const glm::dquat& world_from_head_rotation) = 0;
  /// Advances by input.h_s.
  virtual void substep(const StepInput& input) = 0;
  /// Computes what the substeps of a step share, ahead of the first one, which else does it: for whoever
  /// times it.
  virtual void gather(const StepInput&) {}
  /// Computes the strands that follow others, ahead of the next read_blocks(), which else does it: for
  /// whoever times it.
  virtual void follow_guides() {}
  /// Copies the state out; resizes `state` on first use only.
  virtual void read(SolverState& state) = 0;
  /// As read(), in blocks of strands; without a copy where the solver keeps its strands so. Valid until the
  /// next call to this solver. Allocates on first use only.
  virtual SolverBlocks read_blocks();
  /// Replaces positions and velocities (same layout as read). A strand that is given what it has goes on as
  /// if nothing had happened; another one starts without a history.
  virtual void write(const SolverState& state) = 0;
  /// The head has jumped to this rotation, wherever it is: strands jump along with all that the model knows
  /// of them. Seen from the head nothing has changed.
  virtual void rebase(const glm::dquat& world_from_head_rotation) = 0;
  /// Of the groom that it was loaded with; 0 = none.
  virtual uint32_t strand_count() const = 0;
  /// Bytes the solver keeps on its device.
  virtual uint64_t memory_bytes() const = 0;

  /// What somebody else needs to take the same steps; nullptr for a model without a kernel that others run.
  /// Reads planes back.
  virtual std::shared_ptr<const StepModel> step_model() { return nullptr; }

  /// The strands that it works on when an executor keeps these; nullptr for a solver that has its own.
  virtual const StrandState* strands() const { return nullptr; }
  /// Goes on with strands() as another solver left them; allocates. On an error the other one may go on.
  virtual Status follow() { return {}; }

 private:
  // Of read_blocks(), where strands are not kept in blocks.
  SolverState read_state_;
  StrandBlocks position_m_in_blocks_;
  StrandBlocks velocity_mps_in_blocks_;
};

/// How a head moves: of its joint, and about it; world.
struct HeadMotion {
  glm::dvec3 velocity_mps{0.0};
  glm::dvec3 spin_radps{0.0};
};
/// Between two poses, so long after each other.
HeadMotion head_motion(const Pose& from, const Pose& to, double passed_s);
/// All strands move as the head does from here on, as one that has been carried by it: nothing pulls at them.
void move_with_head(Solver& solver, const HeadMotion& motion);

/// `to` goes on where `from` is, with the same strands: at once when both work on the same strands, else by
/// way of a copy. On an error `from` is as it was.
Status hand_over(Solver& from, Solver& to, const Groom& groom, const glm::dquat& world_from_head_rotation);

}  // namespace strandcast

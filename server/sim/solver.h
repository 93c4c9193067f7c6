// Solver: interface of a strand model; the table in solver_registry.h lists all models. A solver is used from
// one thread, that of its executor if it has one. It never allocates in substep().
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

/// State that was read back, in head-relative world axes, (vertex_count x strand_count), vertex-major, strand
/// fastest.
struct SolverState {
  std::vector<glm::vec3> position_m;
  std::vector<glm::vec3> velocity_mps;
};

/// The same state as views of the memory where it is stored: rows are vertices. The meaning of w is private
/// to the solver.
struct SolverBlocks {
  StrandBlocksView position_m;
  StrandBlocksView velocity_mps;
};

using SolverParameters = std::map<std::string, double>;

class StrandState;

class Solver {
 public:
  virtual ~Solver() = default;
  /// Sets every strand to rest under the given head rotation; allocates. `groom` must be uniform.
  virtual Status load(const Groom& groom, const glm::dquat& world_from_head_rotation) = 0;
  /// Advances the strands by input.h_s seconds.
  virtual void substep(const StepInput& input) = 0;
  /// Computes data shared by the substeps of a step before the first one, which otherwise does it; lets
  /// callers time it.
  virtual void gather(const StepInput&) {}
  /// Computes the strands that follow guides, before the next read_blocks(), which otherwise does it; lets
  /// callers time it.
  virtual void follow_guides() {}
  /// Copies the state out; resizes `state` only on first use.
  virtual void read(SolverState& state) = 0;
  /// Returns the state in blocks of strands, without a copy if the solver stores strands in blocks. Valid
  /// until the next call to this solver. Allocates only on first use.
  virtual SolverBlocks read_blocks();
  /// Replaces positions and velocities (layout as in read()). A strand whose values are unchanged continues
  /// as before; any other starts without a history.
  virtual void write(const SolverState& state) = 0;
  /// Rotates strands and the model's data to this head rotation after a jump of the head. In head space
  /// nothing changes.
  virtual void rebase(const glm::dquat& world_from_head_rotation) = 0;
  /// Returns the strand count of the loaded groom; 0 = none.
  virtual uint32_t strand_count() const = 0;
  /// Returns the bytes that the solver uses on its device.
  virtual uint64_t memory_bytes() const = 0;

  /// Returns the data that others need to simulate the same steps; nullptr for a model whose kernel others
  /// cannot run. Reads planes back.
  virtual std::shared_ptr<const StepModel> step_model() { return nullptr; }

  /// Returns the strands in an executor that the solver works on; nullptr for a solver that stores its own.
  virtual const StrandState* strands() const { return nullptr; }
  /// Continues with strands() in the state in which another solver left them; allocates. After an error the
  /// other solver may continue.
  virtual Status follow() { return {}; }

 private:
  // Of read_blocks(), where strands are not kept in blocks.
  SolverState read_state_;
  StrandBlocks position_m_in_blocks_;
  StrandBlocks velocity_mps_in_blocks_;
};

/// Motion of a head: velocity of its joint, and rotation about it; world.
struct HeadMotion {
  glm::dvec3 velocity_mps{0.0};
  glm::dvec3 spin_radps{0.0};
};
/// Returns the head's motion between two poses that are `passed_s` apart.
HeadMotion head_motion(const Pose& from, const Pose& to, double passed_s);
/// Gives all strands the velocity of the moving head, as if it had carried them, so that nothing pulls at
/// them.
void move_with_head(Solver& solver, const HeadMotion& motion);

/// Lets `to` continue from the state of `from` with the same strands: directly if both work on the same
/// strands, otherwise by a copy. After an error `from` is unchanged.
Status hand_over(Solver& from, Solver& to, const Groom& groom, const glm::dquat& world_from_head_rotation);

}  // namespace strandcast

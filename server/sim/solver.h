// Solver: one strand model behind a small interface; the table in solver_registry.h lists all of them. A
// solver is used from one thread, that of its executor if it has one. A solver never allocates in
// substep().
//
// Frame of the state: world axes with the origin at the head joint of the current step ("head-relative"). It
// keeps float precision anywhere in the world; each step the origin moves by head_shift_m.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <map>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/groom/groom.h"
#include "common/scene/features.h"
#include "common/scene/scene_desc.h"
#include "server/sim/strand_blocks.h"

namespace strandcast {

/// A travelling wave of the gust field: velocity += amplitude * sin(dot(wave_vector, x) - phase).
struct GustWave {
  glm::vec3 amplitude_mps{0.0f};
  glm::vec3 wave_vector_rad_per_m{0.0f};
  float phase_rad = 0.0f;
};
inline constexpr uint32_t kMaxGustWaves = 8;

/// No angle of a root is larger.
inline constexpr double kFreeFollicleRad = std::numbers::pi;

/// Everything one substep needs, at its end time.
struct StepInput {
  double h_s = 1.0 / 60.0;                                  // substep
  glm::dquat world_from_head_rotation{1.0, 0.0, 0.0, 0.0};  // at the end of the substep
  glm::dvec3 head_shift_m{0.0};  // movement of the head joint during the substep, world
  glm::dvec3 gravity_mps2{0.0, -9.81, 0.0};
  /// Gravity under which the groom has its shape, in head space: what a solver with a sag-free groom lets the
  /// pull to the groomed shape carry. Zero: the groom is the shape without gravity.
  glm::dvec3 groom_gravity_in_head_mps2{0.0};
  glm::dvec3 wind_mps{0.0};     // mean wind at the head, world
  std::vector<GustWave> gusts;  // at most kMaxGustWaves; x is relative to the head joint
  /// Most that the first free segment leans from its groomed direction, turned with the head; pi = free.
  double follicle_limit_rad = kFreeFollicleRad;
  std::vector<SphereCollider> colliders;  // centres in head-relative world axes, at the end of the substep
};

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

/// `to` goes on where `from` is, with the same strands: at once when both work on the same strands, else by
/// way of a copy. On an error `from` is as it was.
Status hand_over(Solver& from, Solver& to, const Groom& groom, const glm::dquat& world_from_head_rotation);

}  // namespace strandcast

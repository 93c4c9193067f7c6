// Publisher: reads the solver's state back and makes a Snapshot of it (head space, quantised). A strand with
// a vertex that is no usable number is quarantined: it is published at rest, and repair() puts the solver's
// copy back to rest. Used on the simulation thread; holds no GL objects of its own.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/base/profile.h"
#include "common/codec/snapshot.h"
#include "common/groom/groom.h"
#include "server/sim/solver.h"

namespace strandcast {

/// No hair reaches farther from the head joint along any axis: a vertex beyond it has left the simulation.
inline constexpr float kMaxStrandReachM = 10.0f * kMaxGroomExtentM;

struct PublishInput {
  uint64_t tick = 0;
  int64_t sim_time_ns = 0;
  int64_t motion_time_ns = 0;  // server clock at arrival of the newest motion sample, 0 = none
  Pose world_from_head;        // pose at the end of the step
};

class Publisher {
 public:
  /// `groom` is uniform; `bound_m` is the announced Euclidean error bound.
  Publisher(const Groom& groom, float bound_m);

  /// Allocates nothing but the snapshot (after the first call).
  std::shared_ptr<const Snapshot> publish(Solver& solver, const PublishInput& input);

  /// Strands that the last publish() found broken, ascending. Valid until the next publish().
  std::span<const uint32_t> quarantined() const { return quarantined_; }
  /// Gives the solver the state of the last publish() with the quarantined strands at rest under that head
  /// pose and the others untouched. Call before the next substep when quarantined() is not empty.
  void repair(Solver& solver);

  /// Vertices without a usable position or velocity, since start.
  uint64_t bad_vertex_count() const { return bad_vertex_count_; }
  /// Strands put back to rest, since start; one strand may count many times.
  uint64_t quarantine_count() const { return quarantine_count_; }
  float quantum_m() const { return quantum_m_; }
  const StageTimer& read_timer() const { return read_timer_; }
  const StageTimer& quantise_timer() const { return quantise_timer_; }

 private:
  void find_broken_strands();
  void put_to_rest(uint32_t strand_index, const glm::dmat3& world_from_head);

  uint32_t strand_count_ = 0;
  uint32_t vertex_count_ = 0;
  float quantum_m_ = 0.0f;
  std::vector<glm::vec3> rest_position_m_;     // (vertex_count x strand_count) head space
  std::vector<glm::vec3> position_in_head_m_;  // same shape
  SolverState state_;
  std::vector<uint8_t> is_broken_;  // (strand_count)
  std::vector<uint32_t> quarantined_;
  uint64_t bad_vertex_count_ = 0;
  uint64_t quarantine_count_ = 0;
  StageTimer read_timer_;
  StageTimer quantise_timer_;
};

}  // namespace strandcast

// Publisher: reads back the solver's state and makes a Snapshot of it (head space, quantised). A strand with
// a non-finite or runaway vertex, or with lasting stretch beyond its model's, is quarantined. It is published
// at rest, and repair() resets the solver's copy to rest relative to the head; its neighbours keep every bit.
// One pass over the strands, in blocks, shared with the workers if there are many. Simulation thread; holds
// no GL objects of its own.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/base/worker_pool.h"
#include "common/groom/groom.h"
#include "common/kernels/strand_blocks.h"
#include "common/simd/variants.h"
#include "common/strands/snapshot.h"
#include "server/sim/solver.h"

namespace strandcast {

/// Results of the checks for each strand of a block.
struct BlockFindings {
  std::array<int32_t, kBlockStrands> bad_vertices{};  // without a usable position or velocity
  /// Segments that exceed longest_squared_m2 or whose length is not finite.
  std::array<int32_t, kBlockStrands> stretched_segments{};
  bool has_bad = false;
  bool has_stretched = false;
};

struct BlockQuantise {
  StrandBlocksView position_m;  // world axes
  StrandBlocksView velocity_mps;
  float reach_m = 0.0f;  // farther from the head along an axis no position is usable
  /// Squared limit of the segment before each vertex, (blocks x vertex_count x 16); nullptr: stretch is not
  /// checked.
  const float* longest_squared_m2 = nullptr;
  /// Columns of the rotation.
  std::array<std::array<double, 3>, 3> head_from_world{};
  float quantum_m = 0.0f;
  BlockFindings* findings = nullptr;  // (blocks)
  /// Output, (3 x vertex_count x strand_count) as Snapshot::lattice; equals quantise() of
  /// common/strands/snapshot.h. Values of strands with bad vertices are arbitrary.
  int32_t* lattice = nullptr;
};

struct BlockRange {
  const BlockQuantise* work = nullptr;
  uint32_t begin = 0;  // blocks
  uint32_t end = 0;
};

void quantise_blocks(simd::InstructionSet set, const BlockRange& range);

/// Largest distance of hair from the head joint along any axis; a vertex beyond it has left the simulation.
inline constexpr float kMaxStrandReachM = 10.0f * kMaxGroomExtentM;

// A strand is over-stretched when one segment is longer than at rest by more than this times the row's
// stretch_bound (the largest in the motions that the laws test), and by at least kLeastOverstretch: room for
// motion more violent than those, and for parameters off their defaults. In rest lengths of the segment, or
// of a mean one where that is longer, so that segments of nearly no length do not count.
inline constexpr double kOverstretchPerBound = 4.0;
inline constexpr double kLeastOverstretch = 0.5;
/// Simulated time for which a strand may stay over-stretched; longer than a jolt lasts.
inline constexpr int64_t kOverstretchPatienceNs = 250'000'000;
/// Relative stretch at which a strand is quarantined at once, because its shape is lost.
inline constexpr double kRunawayStretch = 20.0;

/// Returns the relative stretch that a strand may keep; at least kLeastOverstretch.
double overstretch_limit(double stretch_bound);

struct PublishInput {
  uint64_t tick = 0;
  int64_t sim_time_ns = 0;
  int64_t motion_time_ns = 0;         // server clock at arrival of the newest motion sample, 0 = none
  Pose world_from_head;               // pose at the end of the step
  BustCode bust = kRigidBust;         // likewise
  glm::dvec3 head_velocity_mps{0.0};  // of the head joint, world: what a strand at rest moves with
  std::shared_ptr<const StepTrail> trail = {};  // for Snapshot, like the next
  std::optional<Timecode> timecode = {};
};

/// Resources for publishing; they change no bit.
struct PublishMeans {
  WorkerPool* workers = &shared_workers();
  simd::InstructionSet set = simd::widest_set();
};

class Publisher {
 public:
  /// Makes a publisher for a uniform `groom`; `quantum_m` is the lattice step (lattice_step_m() of the
  /// codec).
  Publisher(const Groom& groom, float quantum_m, const PublishMeans& means = {});

  /// Runs both stages: read() and quantise(). Reuses the memory of snapshots that nobody holds any more.
  std::shared_ptr<const Snapshot> publish(Solver& solver, const PublishInput& input) {
    read(solver);
    return quantise(input);
  }
  /// Reads the state back to the processor; waits for the device.
  void read(Solver& solver) { read(solver.read_blocks()); }
  /// Takes a state that is there already.
  void read(const SolverBlocks& blocks);
  /// Makes the snapshot from what read() returned: quarantine, head space, lattice. The solver must not have
  /// been called in between.
  std::shared_ptr<const Snapshot> quantise(const PublishInput& input);

  /// Enables quarantine of strands that stretch beyond overstretch_limit(). `stretch_bound` as in SolverRow.
  /// Without this call stretch is not checked.
  void watch_stretch(double stretch_bound);

  /// Returns the strands that the last publish() found broken or over-stretched, ascending. Valid until the
  /// next publish().
  std::span<const uint32_t> quarantined() const { return quarantined_; }
  /// Resets the solver's quarantined strands to rest under the head pose of the last publish(). Call it
  /// before the next substep if quarantined() is not empty.
  void repair(Solver& solver);

  /// Returns the number of vertices without a usable position or velocity, since start.
  uint64_t bad_vertex_count() const { return bad_vertex_count_; }
  /// Returns how often strands were reset because of unusable numbers, since start.
  uint64_t quarantine_count() const { return quarantine_count_; }
  /// Returns how often strands were reset because of stretch, since start.
  uint64_t overstretch_count() const { return overstretch_count_; }
  float quantum_m() const { return quantum_m_; }
  /// Changes the lattice step from the next publish() on.
  void set_quantum_m(float quantum_m) { quantum_m_ = quantum_m; }

 private:
  struct SnapshotMemory;

  std::unique_ptr<Snapshot> take_snapshot();
  static void give_back(SnapshotMemory& memory, Snapshot* snapshot);
  void walk_blocks(const glm::dmat3& head_from_world, Snapshot& snapshot);
  void find_broken_strands();
  void find_overstretched_strands(int64_t sim_time_ns);
  bool has_segment_beyond(std::span<const float> squared_m2, uint32_t strand_index) const;
  void show_at_rest(uint32_t strand_index, const glm::dmat3& head_from_world, Snapshot& snapshot) const;
  glm::vec3 rest_in_world_m(size_t i) const;
  size_t place_in_blocks(uint32_t strand_index, uint32_t vertex) const;

  uint32_t strand_count_ = 0;
  uint32_t vertex_count_ = 0;
  float quantum_m_ = 0.0f;
  PublishMeans means_;
  std::vector<glm::vec3> rest_position_m_;  // (vertex_count x strand_count) head space
  SolverBlocks blocks_;                     // the solver's own, from read() on
  std::vector<BlockFindings> findings_;     // (blocks) of the last publish()
  std::shared_ptr<SnapshotMemory> memory_;  // lasts as long as snapshots do
  // (blocks x vertex_count x 16) squares of the longest that the segment before a vertex may be; empty =
  // stretch is not watched.
  std::vector<float> longest_squared_m2_;
  std::vector<float> runaway_squared_m2_;
  std::vector<int64_t> overstretched_since_ns_;  // (strand_count) kNotOverstretched = not
  uint32_t overstretched_now_ = 0;               // strands that are
  // Of the last publish().
  glm::dmat3 world_from_head_rotation_{1.0};
  glm::vec3 head_velocity_mps_{0.0f};
  std::vector<uint32_t> quarantined_;
  uint64_t bad_vertex_count_ = 0;
  uint64_t quarantine_count_ = 0;
  uint64_t overstretch_count_ = 0;
};

}  // namespace strandcast

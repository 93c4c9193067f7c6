// Snapshot: one published state of all strands, quantised in head space. Immutable once published
// (shared_ptr<const Snapshot>), so any thread may read it. Server and clients draw from snapshots, never from
// the solver's floats.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/base/timecode.h"
#include "common/math/bust.h"
#include "common/math/pose.h"

namespace strandcast {

struct StepTrail;

/// Everything about a state except its positions: identity, times, poses and the lattice of the positions.
struct SnapshotInfo {
  uint64_t tick = 0;           // simulation step number
  int64_t sim_time_ns = 0;     // tick x step, from 0
  int64_t motion_time_ns = 0;  // server clock at arrival of the newest motion sample in this state, 0 = none
  Pose world_from_head;
  BustCode bust = kRigidBust;  // how neck and chest are turned; no part of the state hash
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;  // per strand
  float quantum_m = 0.0f;     // lattice step; error of a vertex <= quantum * sqrt(3) / 2
  /// Steps that led to this state, for codecs that predict by simulating them; nullptr = not known. Not part
  /// of the state hash.
  std::shared_ptr<const StepTrail> trail = {};
  std::optional<Timecode> timecode = {};  // of the motion that it shows, at the server; likewise

  size_t plane_size() const { return static_cast<size_t>(strand_count) * vertex_count; }
};

struct Snapshot : SnapshotInfo {
  std::vector<int32_t> lattice;  // (3 x vertex_count x strand_count) axis-major, then vertex, strand fastest
};

/// Upper limit of |lattice|, chosen so that sums of three values fit in 32 bits. Positions outside are
/// clamped.
inline constexpr int32_t kMaxLattice = 1 << 28;

/// Distance from the head joint, along each axis in metres, within which the announced bound holds. Beyond it
/// float positions themselves become coarser.
inline constexpr float kBoundReachM = 2.0f;

/// Finest bound that a stream can announce, in metres; scene checks use it.
inline constexpr float kMinBoundM = 1e-6f;

/// Returns the coarsest cubic lattice step (m) whose rounding error stays within the Euclidean bound. It is 2
/// bound / sqrt(3), less the rounding error of float positions within kBoundReachM. `bound_m` is at least
/// kMinBoundM.
float quantum_for_bound(float bound_m);

struct QuantiseInput : SnapshotInfo {
  std::span<const glm::vec3>
      position_in_head_m;                 // (vertex_count x strand_count) vertex-major, strand fastest
  std::span<const glm::vec3> fallback_m;  // same shape, or empty: zero; used where a position is not finite
};

struct Quantised {
  Snapshot snapshot;
  uint64_t replaced_count = 0;  // vertices that were not finite
};

/// Rounds positions to the lattice; positions beyond it are clamped.
Quantised quantise(const QuantiseInput& input);

/// Returns positions in head space, metres, shape (vertex_count x strand_count): vertex-major, strand
/// fastest.
std::vector<glm::vec3> positions_in_head(const Snapshot& snapshot);

/// Hash of a snapshot without motion_time_ns and positions; the state hash continues from it.
uint64_t info_hash(const SnapshotInfo& info);

/// Hash of a snapshot without motion_time_ns; equal on server and client for the same tick.
uint64_t state_hash(const Snapshot& snapshot);

}  // namespace strandcast

// Snapshot: one published state of all strands, quantised in head space. Immutable once published
// (shared_ptr<const Snapshot>), so any thread may read it. Server frames and clients draw from this, never
// from the solver's floats.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

#include "common/math/bust.h"
#include "common/math/pose.h"

namespace strandcast {

struct StepTrail;

/// What a state is of, and how its positions are kept: all but the positions themselves.
struct SnapshotInfo {
  uint64_t tick = 0;           // simulation step number
  int64_t sim_time_ns = 0;     // tick x step, from 0
  int64_t motion_time_ns = 0;  // server clock at arrival of the newest motion sample in this state, 0 = none
  Pose world_from_head;
  BustCode bust = kRigidBust;  // how neck and chest are turned; no part of the state hash
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;  // per strand
  float quantum_m = 0.0f;     // lattice step; error of a vertex <= quantum * sqrt(3) / 2
  /// How the simulation got here, for codecs that predict by its steps; nullptr = nobody knows. No part of
  /// the state hash.
  std::shared_ptr<const StepTrail> trail = {};

  size_t plane_size() const { return static_cast<size_t>(strand_count) * vertex_count; }
};

struct Snapshot : SnapshotInfo {
  std::vector<int32_t> lattice;  // (3 x vertex_count x strand_count) axis-major, then vertex, strand fastest
};

/// |lattice| stays below this, so that sums of three of them fit in 32 bits; positions outside are clamped.
inline constexpr int32_t kMaxLattice = 1 << 28;

/// The announced bound holds for vertices within this distance of the head joint along every axis; farther
/// out the float positions themselves become coarser.
inline constexpr float kBoundReachM = 2.0f;

/// Finest bound that a stream can announce; the checks of a scene use it.
inline constexpr float kMinBoundM = 1e-6f;

/// Coarsest cubic lattice step whose rounding error stays within the Euclidean bound: 2 bound / sqrt(3), less
/// the rounding of float positions within kBoundReachM. `bound_m` is at least kMinBoundM.
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

/// Rounds positions to the lattice. Positions beyond the lattice are clamped to it.
Quantised quantise(const QuantiseInput& input);

/// Head-space positions in metres, (vertex_count x strand_count x vec3), vertex-major, strand fastest.
std::vector<glm::vec3> positions_in_head(const Snapshot& snapshot);

/// Hash of everything in a snapshot but motion_time_ns and the positions: what that of the positions goes on
/// from.
uint64_t info_hash(const SnapshotInfo& info);

/// Hash of everything in a snapshot but motion_time_ns; equal on server and client for the same tick.
uint64_t state_hash(const Snapshot& snapshot);

}  // namespace strandcast

// Coherence: how much of a head of hair moves together, from strands at some moments. Pure functions in
// double precision, any thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>

namespace strandcast {

/// Distance within which vertices of other strands are neighbours.
inline constexpr double kNeighbourReachM = 0.015;
/// Number of neighbours below which a vertex or segment counts as alone.
inline constexpr uint32_t kLeastNeighbours = 4;

/// Strands at one moment in one frame of reference; (vertex_count x strand_count), strand fastest.
struct HairMoment {
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;
  std::span<const glm::dvec3> position_m;
  std::span<const glm::dvec3> velocity_mps;
};

/// Returns the first vertex of a strand that is measured, for example the fifth of sixteen; earlier ones move
/// with the head.
uint32_t first_measured_vertex(uint32_t vertex_count);

/// Sums over vertices and segments; those of several moments can be added.
struct Coherence {
  double apart_m2ps2 = 0.0;  // squared velocities relative to the neighbours' mean
  double whole_m2ps2 = 0.0;  // the same vertices' squared velocities relative to the mean of all of them
  double aligned = 0.0;      // lengths of the mean directions of the neighbours of each segment
  uint64_t vertex_count = 0;
  uint64_t lone_count = 0;     // of the vertices, those that are alone
  uint64_t segment_count = 0;  // that are not alone

  /// Returns the energy of motion relative to the neighbours over that relative to the overall mean; 0 if
  /// nothing moves.
  double incoherent_share() const;
  /// Returns the root mean square of velocity relative to the overall mean; if it is small, the share means
  /// little.
  double motion_mps() const;
  /// Returns the share of vertices that are alone.
  double lone_share() const;
  /// Returns 1 if neighbouring segments are parallel, 0 if their directions are random or all are alone.
  double order() const;

  Coherence& operator+=(const Coherence& other);
};

/// Measures one moment; vertices without usable positions count as alone. Equal input gives equal bits.
Coherence measure_coherence(const HairMoment& moment);

}  // namespace strandcast

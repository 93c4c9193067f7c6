// How much of a head of hair moves as one: measures of strands at some moments. Pure functions in double
// precision, any thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>

namespace strandcast {

/// Vertices of other strands that are nearer than this are neighbours.
inline constexpr double kNeighbourReachM = 0.015;
/// A vertex or segment with fewer neighbours is alone.
inline constexpr uint32_t kLeastNeighbours = 4;

/// Strands at one moment, all in one frame of reference; (vertex_count x strand_count), strand fastest.
struct HairMoment {
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;
  std::span<const glm::dvec3> position_m;
  std::span<const glm::dvec3> velocity_mps;
};

/// First vertex of a strand that is measured: vertices before it go with the head. The fifth of sixteen.
uint32_t first_measured_vertex(uint32_t vertex_count);

/// Sums over vertices and segments; those of several moments add up.
struct Coherence {
  double apart_m2ps2 = 0.0;  // squared velocities relative to the neighbours' mean
  double whole_m2ps2 = 0.0;  // the same vertices' squared velocities relative to the mean of all of them
  double aligned = 0.0;      // lengths of the mean directions of the neighbours of each segment
  uint64_t vertex_count = 0;
  uint64_t lone_count = 0;     // of the vertices, those that are alone
  uint64_t segment_count = 0;  // that are not alone

  /// Energy of the motion against the neighbours over that against the mean of all; 0 where nothing moves.
  double incoherent_share() const;
  /// How fast it moves against the mean of all, root mean square: a share of little motion says little.
  double motion_mps() const;
  /// Share of the vertices that are alone.
  double lone_share() const;
  /// 1: neighbouring segments are parallel; 0: they point anywhere, or all are alone.
  double order() const;

  Coherence& operator+=(const Coherence& other);
};

/// Vertices without usable positions are alone. The same moment gives the same bits.
Coherence measure_coherence(const HairMoment& moment);

}  // namespace strandcast

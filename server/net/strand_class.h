// StrandClass: one way of coding the strand stream. Every class is encoded once for all viewers in it, and
// only while somebody is in it; a viewer whose link or machine is too slow moves to a cheaper one. Pure data,
// any thread.
#pragma once

#include <cstdint>
#include <vector>

namespace strandcast {

struct StrandClass {
  uint32_t rate_divisor = 1;  // every so many simulation steps
  float strand_share = 1.0f;  // in (0, 1]
  uint32_t coarsening = 1;    // lattice steps per step of the published lattice
  float bound_m = 1e-4f;      // announced Euclidean error
  double frame_rate_hz = 60.0;
  double relative_cost = 1.0;  // bytes per second against the first class; an estimate until it was measured
};

/// Cheaper classes keep at least this rate.
inline constexpr double kLeastFrameRateHz = 10.0;
/// No class is coarser than this.
inline constexpr float kCoarsestBoundM = 5e-4f;

/// The classes for a simulation of this rate and this bound, best first; the index is the stream_id. First
/// the rate is lowered, then the bound.
std::vector<StrandClass> make_strand_classes(double step_rate_hz, float bound_m);

}  // namespace strandcast

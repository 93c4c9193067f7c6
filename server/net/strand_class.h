// StrandClass: one way of coding the strand stream. Every class is encoded once for all viewers in it, and
// only while somebody is in it; a viewer whose link or machine is too slow moves to a cheaper one. Pure data,
// any thread.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace strandcast {

struct StrandClass {
  uint32_t rate_divisor = 1;  // every so many simulation steps
  float strand_share = 1.0f;  // in (0, 1]: the first so many strands
  uint32_t coarsening = 1;    // lattice steps per step of the published lattice
  float bound_m = 1e-4f;      // announced Euclidean error
  double frame_rate_hz = 60.0;
  double relative_cost = 1.0;  // bytes per second against the first class; an estimate until it was measured
};

/// Cheaper classes keep at least this rate,
inline constexpr double kLeastFrameRateHz = 10.0;
/// and at least so many strands: fewer no longer show how the hair between them moves.
inline constexpr uint32_t kLeastPrefixStrands = 120;
/// No class is coarser than this.
inline constexpr float kCoarsestBoundM = 5e-4f;

/// What the first class is to be.
struct StrandStreamPlan {
  double step_rate_hz = 60.0;
  double rate_hz = 0.0;  // at most; 0 = every step
  float bound_m = 1e-4f;
  uint32_t strand_count = 1;
};

/// The classes of a stream, best first; the index is the stream_id. First there are fewer strands, then the
/// rate is lowered, then the bound is coarser.
std::vector<StrandClass> make_strand_classes(const StrandStreamPlan& plan);

/// For a person: "1/4 of the strands, 30 Hz, 0.1 mm".
std::string to_string(const StrandClass& row);

}  // namespace strandcast

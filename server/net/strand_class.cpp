#include "server/net/strand_class.h"

#include <cmath>

namespace strandcast {
namespace {

/// Bytes per second fall with this power of the rate: rarer frames are harder to predict. Measured with the
/// adaptive codec on the built-in scene and on walking motion, divisors 2 to 6: 0.50 to 0.58.
constexpr double kRatePower = 0.54;
/// Measured likewise, from 0.1 mm to 0.5 mm: 0.60 to 0.67.
constexpr double kCoarseCost = 0.63;
/// A lattice that is coarser by less saves too little to be worth a keyframe.
constexpr uint32_t kLeastCoarsening = 2;

/// Rounding to every k-th point of a lattice adds at most k times the error that the lattice has already.
uint32_t coarsening_for(float bound_m) {
  const double factor =
      std::floor(static_cast<double>(kCoarsestBoundM) / static_cast<double>(bound_m) + 1e-6) - 1.0;
  return factor >= kLeastCoarsening ? static_cast<uint32_t>(factor) : 1;
}

}  // namespace

std::vector<StrandClass> make_strand_classes(double step_rate_hz, float bound_m) {
  struct Row {
    uint32_t rate_divisor;
    bool is_coarse;
  };
  constexpr Row kRows[] = {{1, false}, {2, false}, {3, false}, {3, true}, {4, true}, {6, true}};
  const uint32_t coarsening = coarsening_for(bound_m);
  std::vector<StrandClass> classes;
  for (const Row& row : kRows) {
    StrandClass made;
    made.rate_divisor = row.rate_divisor;
    made.frame_rate_hz = step_rate_hz / row.rate_divisor;
    made.coarsening = row.is_coarse ? coarsening : 1;
    made.bound_m = made.coarsening > 1 ? bound_m * static_cast<float>(1 + coarsening) : bound_m;
    made.relative_cost = std::pow(row.rate_divisor, -kRatePower) * (made.coarsening > 1 ? kCoarseCost : 1.0);
    const bool is_new = classes.empty() || made.relative_cost < classes.back().relative_cost;
    const bool is_fast_enough = row.rate_divisor == 1 || made.frame_rate_hz >= kLeastFrameRateHz;
    if (is_new && is_fast_enough) classes.push_back(made);
  }
  return classes;
}

}  // namespace strandcast

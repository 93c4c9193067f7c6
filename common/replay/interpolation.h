// Interpolation: strands and head between states that are known: on the line between two, or on the cubic
// through four where they are there and near enough in time. Exact at the states. Pure arithmetic; positions
// have the same bits from every instruction set.
//
// Lagrange's cubic: between states h apart it errs by 3/128 h^4 |x''''| at most, the line by 1/8 h^2 |x''|.
// Catmull-Rom's, which has no kink at the states, is as good in the middle and errs by h^3 elsewhere. On
// recorded hair both err alike (30 Hz: 0.4 to 0.8 of the line's), Lagrange's a little less, and its kinks are
// h^2 |x''''| / 6 |x''| of the line's. Uneven times change little: with a neighbour eight times as far or as
// near in time as the states between, the cubic still errs less than the line, down to 10 states a second.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <memory>

#include "common/simd/variants.h"
#include "common/strands/posed_strands.h"
#include "common/strands/snapshot.h"

namespace strandcast {

enum class Interpolation {
  None,    // a state as it is
  Linear,  // between two states
  Cubic,   // through four
};
/// "none", "linear", "cubic".
const char* to_string(Interpolation interpolation);

/// Simulated times of four states, each later than the one before.
using KnotTimes = std::array<int64_t, 4>;

inline constexpr int64_t kLongestCubicStepNs = 150'000'000;  // farther apart nothing was measured
inline constexpr int64_t kMostUnevenSteps = 8;               // the outer steps against the inner one

/// How to go from state `later - 1` to state `later` of these, the oldest first: by a cubic where the
/// states before and after are there too and the gaps between them (frames that were lost) are neither long
/// nor very uneven.
Interpolation choose_interpolation(const std::deque<std::shared_ptr<const Snapshot>>& states, size_t later);

/// The cubic through x0 .. x3 between x1 and x2, as the line between these and its bend:
///   before = before_scale (x1 - x0), step = x2 - x1, after = after_scale (x3 - x2)
///   x1 + blend step + bend_before (step - before) + bend_after (after - step).
/// Newton's form by divided differences: the parabolas through the first and the last three, weighted.
struct CubicTerms {
  double blend = 0.0;         // 0 gives x1, 1 gives x2
  double before_scale = 1.0;  // the outer steps as long in time as the inner one
  double after_scale = 1.0;
  double bend_before = 0.0;
  double bend_after = 0.0;
};
CubicTerms cubic_terms(const KnotTimes& sim_time_ns, int64_t time_ns);

/// A head that turns faster than this in the time between the inner states, or jumps as kJumpSteps says, goes
/// on the line; farther the components' cubic could lead past zero.
inline constexpr double kMostCubicTurnRad = 1.0;
Pose interpolate(const std::array<Pose, 4>& poses, const CubicTerms& terms);

/// Strands between two states; blend 0 gives `from`, 1 gives `to`. Positions blend in head space, so a
/// turning head carries the hair round instead of cutting through it. `to` where their numbers differ.
PosedStrands blend(const PosedStrands& from, const PosedStrands& to, double blend,
                   simd::InstructionSet set = simd::widest_set());
/// Strands of equal numbers on the cubic through four states, in head space too, and so is the head's way.
PosedStrands blend(const std::array<const PosedStrands*, 4>& states, const CubicTerms& terms,
                   simd::InstructionSet set = simd::widest_set());

}  // namespace strandcast

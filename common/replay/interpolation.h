// Interpolation: strands and head between known states. Linear between two states, or cubic through four if
// they exist and are close enough in time. Exact at the states. Pure arithmetic; positions have the same bits
// from every instruction set.
//
// The cubic is Lagrange's. Between states h apart its error is at most 3/128 h^4 |x''''|; the line's is 1/8
// h^2 |x''|. Catmull-Rom's cubic has no kink at the states and equals it in the middle, but its error is of
// order h^3 elsewhere. On recorded hair (30 Hz) both have 0.4 to 0.8 of the line's error, Lagrange's a little
// less. Its kinks are h^2 |x''''| / 6 |x''| of the line's. Uneven times matter little: down to 10 states a
// second the cubic stays better than the line, even with a neighbour eight times as far or as near as the
// inner states.
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
/// Returns "none", "linear" or "cubic".
const char* to_string(Interpolation interpolation);

/// Simulated times of four states, strictly increasing.
using KnotTimes = std::array<int64_t, 4>;

inline constexpr int64_t kLongestCubicStepNs = 150'000'000;  // farther apart nothing was measured
inline constexpr int64_t kMostUnevenSteps = 8;               // the outer steps against the inner one

/// Chooses the interpolation between states `later - 1` and `later`; `states` are ordered by time. Cubic if
/// the states before and after exist, and gaps (lost frames) are neither long nor very uneven.
Interpolation choose_interpolation(const std::deque<std::shared_ptr<const Snapshot>>& states, size_t later);

/// Weights of the cubic through x0 .. x3 between x1 and x2, as the line between x1 and x2 plus a bend. before
/// = before_scale (x1 - x0), step = x2 - x1, after = after_scale (x3 - x2). Value: x1 + blend step +
/// bend_before (step - before) + bend_after (after - step). Newton's form by divided differences: a weighted
/// mean of the parabolas through the first and the last three states.
struct CubicTerms {
  double blend = 0.0;         // 0 gives x1, 1 gives x2
  double before_scale = 1.0;  // the outer steps as long in time as the inner one
  double after_scale = 1.0;
  double bend_before = 0.0;
  double bend_after = 0.0;
};
CubicTerms cubic_terms(const KnotTimes& sim_time_ns, int64_t time_ns);

/// Largest rotation of the head between the inner states for which its cubic is used; beyond it the
/// components could pass through zero. A larger one, or a jump (kJumpSteps), is interpolated linearly.
inline constexpr double kMostCubicTurnRad = 1.0;
Pose interpolate(const std::array<Pose, 4>& poses, const CubicTerms& terms);

/// Interpolates strands linearly between two states; blend 0 gives `from`, 1 gives `to`. Positions are
/// interpolated in head space, so hair follows a rotating head instead of cutting through it. Returns `to` if
/// the numbers of strands or vertices differ.
PosedStrands blend(const PosedStrands& from, const PosedStrands& to, double blend,
                   simd::InstructionSet set = simd::widest_set());
/// Interpolates strands of equal counts on the cubic through four states, in head space, and the head's pose
/// too.
PosedStrands blend(const std::array<const PosedStrands*, 4>& states, const CubicTerms& terms,
                   simd::InstructionSet set = simd::widest_set());

}  // namespace strandcast

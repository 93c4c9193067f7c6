// StyleFit: the least stiffening per strand with which a groom lasts under its weight. A sag-free groom is an
// equilibrium of its rods; whether it is a stable one, the second variation of their energy says. Found once
// per groom and constants, kept in memory. Any thread, no GL.
//
// Unknowns: a small rotation per free edge (two for its direction, one for its spin). With J the stiffness of
// a joint and M the moment it carries, the energy's second variation H is block tridiagonal:
//   joint  J on either edge and -J + [M]x / 2 between them, with u the mean tangent, a the bend axis,
//          e = a x u, h half of the bend, tau the twist and B, T the moments per angle:
//          J = B (a a' + h cot(h) e e' - h tan(h) u u') + T (u u' / cos^2(h) + tau sin(h) / cos^2(h) sym(u
//          a'))
//   weight l ((F.t) 1 - sym(F t')) on an edge of length l along t that the weight F pulls at.
// A vertex moves by the sum of l (phi x t) over the edges before it. The shape is held with margin m when
// H - w^2 M is positive, M being the vertices' mass and w^2 = m |g| / length: no motion is slower than that
// of a chain that hangs, for m = 1.446. More stiffness only helps, so the least factor is found by bisection;
// the rest shape is made anew for each. The factor is below 1 for strands whose edges are so short that
// single precision could not move them otherwise.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "server/sim/solvers/direct_rod/direct_rod_rest.h"

namespace strandcast {

/// Lowest frequency squared of a hanging chain over g / length: (2.40483 / 2)^2, from the first zero of J0.
inline constexpr double kHangingMargin = 1.446;
/// Largest factor of a strand's stiffness: that of a fibre of 3.4 times the radius.
inline constexpr double kMaxStiffening = 128.0;
/// Number of factors tried per doubling: the chosen one is within 1.1 % of the least that holds.
inline constexpr int kStiffeningSteps = 64;

/// Second variation of a strand's energy over its mass per length, in the rotations of its free edges, root
/// first. next[k] stands between edges k - 1 and k (next[0] is unused).
struct RodHessian {
  std::vector<glm::dmat3> diagonal;
  std::vector<glm::dmat3> next;
};
/// At the shape as loaded; the parameters hold the strand's stiffening already.
RodHessian rod_hessian(const RodShape& shape, const RodParameters& parameters);

/// Whether the shape is an equilibrium (no joint is asked to turn further than it can push back) and every
/// motion of it faster than `least_rate_squared`, 1/s^2.
bool is_rod_held(const RodShape& shape, const RodParameters& parameters, double least_rate_squared);

struct StyleFit {
  std::vector<float> stiffening;  // per strand, at most kMaxStiffening
  uint32_t unheld_count = 0;      // strands that kMaxStiffening does not hold
};

/// nullptr when told to stop. The last few fits are kept: the same groom and constants cost a hash.
std::shared_ptr<const StyleFit> fit_rod_style(const StrandLayout& layout, const RodParameters& parameters,
                                              const glm::dvec3& groom_gravity_in_head_mps2,
                                              const std::stop_token& stop = {});

/// A sentence or two for people.
std::vector<std::string> describe(const StyleFit& fit);

/// SolverRow::prepare.
Result<std::vector<std::string>> prepare_rod_style(const Groom& groom, const SolverParameters& parameters,
                                                   const glm::dvec3& groom_gravity_in_head_mps2,
                                                   const std::stop_token& stop);

}  // namespace strandcast

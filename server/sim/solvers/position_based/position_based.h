// pbd and xpbd: constraints between the positions of a strand, solved one after the other from root to tip,
// several times per step (Gauss-Seidel). Constraints of vertex i: its distance to vertex i-1 (stretch) and to
// vertex i-2 (bending: the angle between two segments sets that distance). A straight strand resists bending
// by this only to second order, a bent one to first.
//
// Both: x = x_predicted, then per constraint C with gradient along the line between the two vertices
//   pbd    dx = -w / (w_a + w_b) k' C,  k' = 1 - (1 - k)^(1 / iterations)  (Woodhouse, 2.1; Mueller et al.
//          2007, equations 10, 11 and section 3.3)
//   xpbd   dlambda = (-C - a lambda) / (w_a + w_b + a),  a = compliance / h^2,  dx = w dlambda
//          (Macklin, Mueller, Chentanez 2016, equations 17 and 18)
//   tractrix_hybrid  xpbd with tractrix sweeps: each vertex follows the one before it, which the sweep has
//   just
//          moved, and the segment between them gets its length. Zappe 2020 chapter 6 asks whether that saves
//          iterations: tests/property/tractrix_test.cpp answers. After the iterations they finish the lengths
//          exactly, outside of the velocity (within it they would drive the strand); before them they are a
//          first guess, which misleads: the constraints are then met, but not where the masses want it.
// and v = (x - x_old) / h. Every vertex has the mass of one segment, the tip of half of one; pinned vertices
// have w = 0 and stay exactly where the head is. Lengths are not exact: what is left of the stretch falls
// with the iterations, and the smaller the substep. Colliders push vertices out last in each iteration.
#pragma once

#include "server/sim/solver_registry.h"

namespace strandcast {

/// What both versions of both rows read from the parameters.
struct PositionBasedParameters {
  uint32_t iterations = 1;
  bool is_compliant = false;            // xpbd
  uint32_t tractrix_sweeps = 0;         // tractrix_hybrid
  bool has_tractrix_first = false;      // tractrix_hybrid
  double stretch_share = 1.0;           // pbd: of the error, per iteration
  double bend_share = 0.0;              // pbd
  double stretch_compliance_mpn = 0.0;  // xpbd
  double bend_compliance_mpn = 0.0;     // xpbd
  double linear_density_kgpm = 0.0;     // xpbd
};

PositionBasedParameters read_position_based(const SolverParameters& parameters, bool is_compliant);

SolverRow pbd_row();
SolverRow xpbd_row();
SolverRow tractrix_hybrid_row();

std::unique_ptr<Solver> make_position_based_reference(const SolverParameters& parameters, bool is_compliant);

}  // namespace strandcast

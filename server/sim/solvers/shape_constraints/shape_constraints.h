// shape_constraints: the TressFX model. Sources: PT1 = "Unity custom hair simulation PT1" (the tutorial on
// TressFX, by its section names), Zappe 2020, 2.2.2 algorithm 1, Woodhouse 2017, 2.1.5, and the order and
// defaults of TressFX 4.1. Steps of one substep of h seconds, and how each differs from its source:
//
//   shock propagation  A share c of every change of the root's motion goes to the whole strand at once.
//   TressFX
//     moves positions now and before by c of the root's rigid motion T; Verlet velocities are their
//     difference, so that v changes by c of the change of T's velocity, which is what is done here to true
//     velocities: v <- turned(r) + (1 - c) W_before + c W_now, r = v - W_before, W = velocity field of the
//     rigid motion. From an acceleration a of the root on c grows, and is 1 from 2 a on (a switch would make
//     it flicker).
//   Verlet (PT1 "Verlet Integration")  x' = x + v h + a h^2. The damping is a rate (8 % of 1/60 s = 4.8 1/s),
//     taken from r, so that it does not brake a head in uniform motion.
//   wind  Drag towards the air, per second, less along the strand than across it. TressFX 4.1 multiplies
//   twice
//     with the edge itself, whose length then sets the force.
//   global shape (PT1 "Global constraints")  x' += S (target - x'). With S = h^2 s / (1 + h^2 s) this is a
//     spring of stiffness s per mass, backward Euler, at any h: the shared pull to the groomed shape, which
//     carries the groom's weight.
//   local shape (PT1 "Local constraints")  Segment e_i is turned towards R e_i0, where R is the shortest turn
//     of the groomed direction of the segment before it to its present one, half of the error at either end.
//     PT1's share per iteration is a stiffness that grows with the rate, the iterations and the vertices.
//     Here each constraint has a compliance (XPBD, equation 18): with k its stiffness, the couple of forces k
//     (R e_i0 - e_i) at the segment's ends must carry the shear force there, because the segment before takes
//     no reaction. So curvature = shear force / (k l^2), and k l^2 = 8 b / (3 L) rho gives a clamped strand
//     of length L the small droop w L^4 / (8 b rho) of a rod with bending stiffness b per mass per length,
//     for any number of vertices. At 1/60 s, 15 segments of 0.25 m in all and b of real hair a lone error
//     falls by 0.65 per iteration; TressFX has 0.9. Two iterations (TressFX's number) leave long strands
//     softer than b; from four on stiffness is that of b at any rate. The missing reaction is why strands of
//     several hairs' stiffness, or folded back under pressure with four iterations, may flutter: direct_rod
//     is the row for those. The first segment's angle is that to the head.
//   length (PT1 "Edge constraints")  Both ends by w_1 / (w_1 + w_2) of the error, segments after even
//   vertices,
//     then after odd ones.
//   ad-hoc pass (Zappe algorithm 1)  One walk from root to tip gives every segment a length within a limit of
//     stretch, which is 0 while the root's acceleration is fast; then velocities relative to the head are
//     damped as well. The limit between is ours: Zappe finds the convergence poor, and this bounds what is
//     left.
//   colliders  turn segments out in that walk, as in the dftl row.
// All vertices have the same mass (PT1).
#pragma once

#include "server/sim/solver_registry.h"

namespace strandcast {

/// What both versions of the solver read from the parameters.
struct ShapeConstraintsParameters {
  uint32_t length_iterations = 1;
  uint32_t shape_iterations = 0;
  double bend_stiffness_m4ps2 = 0.0;
  double shape_relaxation = 1.0;  // share of each correction of the local shape
  double shock_share = 0.0;
  double fast_mps2 = 1.0;
  double damping_per_s = 0.0;
  double stretch_limit = 0.0;
  double fast_damping_per_s = 0.0;
  double air_along_share = 1.0;
};

ShapeConstraintsParameters read_shape_constraints(const SolverParameters& parameters);

SolverRow shape_constraints_row();

std::unique_ptr<Solver> make_shape_constraints_reference(const SolverParameters& parameters);

}  // namespace strandcast

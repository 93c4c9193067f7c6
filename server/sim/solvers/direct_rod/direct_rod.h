// direct_rod: an inextensible elastic rod with bending, twist and natural curvature, implicit in time, solved
// by one banded factorisation per strand and solve. Everything is divided by the mass per length, so that the
// rod has two constants (bending and twist stiffness over mass per length, m^4/s^2) and tensions are in
// m^2/s^2.
//
// Model, with b = EI / (rho A), c = GJ / (rho A), e_i = edge before vertex i, t_i its direction, l_i its
// length, F_i its material frame (third axis t_i):
//   tension: force g_i t_i per edge, g_i a multiplier kept between steps (augmented Lagrangian, penalty k).
//   joint: F_(i-1) and F_i each carry half of the rest rotation to the vertex; what is left between them is a
//     bend theta and a twist tau about their mean tangent, with the energy (b theta^2 + c tau^2) / (2 l_v).
//   twist: without inertia; one angle per edge is solved for beside the positions (the quasi-static twist of
//     Bergou et al. 2008, section 5, for rods of any rest shape).
//   time: second-order backward differences (order 2, with steps of any length) or backward Euler.
//
//   style: a groom is an equilibrium with sag_free, but not always a stable one. Strands that would leave it
//     have bending and twist times a factor found once (direct_rod_style.h), the same along the strand.
//
// After each solve every edge gets its exact length back. The twist of a straight rod with a free tip is
// zero: the kernel has a variant without. Vertices that coincide at rest are a hinge.
#pragma once

#include "server/sim/solver_registry.h"

namespace strandcast {

/// What both versions of the solver read from the parameters.
struct RodParameters {
  double stiffness_m4ps2 = 0.0;        // EI / (rho A)
  double twist_stiffness_m4ps2 = 0.0;  // GJ / (rho A)
  double spin_inertia_m2 = 0.0;        // of the cross section about the tangent, over its area
  double tip_length_m = 0.0;           // of hair as heavy as the bead at the tip
  double bending_damping_s = 0.0;      // Kelvin-Voigt: moments lead by this time
  double air_drag_per_s = 0.0;
  double collider_friction = 0.0;
  double max_speed_mps = 0.0;  // relative to the head, of what a step starts from
  uint32_t solves = 1;         // linear solves per step
  uint32_t order = 2;          // of the time integration
  double sag_free = 0.0;       // share of the groom's weight that its rest shape carries
  double style_margin = 0.0;   // of the groomed shape's stability, see direct_rod_style.h; 0 = none is sought
};

RodParameters read_rod_parameters(const SolverParameters& parameters);

SolverRow direct_rod_row();

Result<std::unique_ptr<Solver>> make_direct_rod(const SolverParameters& parameters,
                                                const SolverContext& context);
std::unique_ptr<Solver> make_direct_rod_reference(const SolverParameters& parameters);

}  // namespace strandcast

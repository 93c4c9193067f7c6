// direct_rod: an inextensible elastic rod with bending and natural curvature, implicit in time, solved by one
// banded factorisation per strand and solve. Everything is divided by the mass per length, so that the rod
// has one constant (bending stiffness over mass per length, m^4/s^2) and tensions are in m^2/s^2.
//
// Model, with b = EI / (rho A), e_i = edge before vertex i, t_i its direction, l_i its length:
//   tension     force g_i t_i per edge, g_i a multiplier kept between steps (augmented Lagrangian, penalty
//   k); bending     b / (2 l_v) theta^2 per joint, theta between t_(i+1) and its rest direction u_i, which
//   turns
//               with the edge before it in a frame carried from the clamp without twist;
//   time        second-order backward differences (order 2, with steps of any length) or backward Euler.
// After each solve every edge gets its exact length back. No twist: a curl is kept by bending alone.
#pragma once

#include "server/sim/solver_registry.h"

namespace strandcast {

/// What both versions of the solver read from the parameters.
struct RodParameters {
  double stiffness_m4ps2 = 0.0;    // EI / (rho A)
  double bending_damping_s = 0.0;  // Kelvin-Voigt: bending moments lead by this time
  double air_drag_per_s = 0.0;
  double collider_friction = 0.0;
  double max_speed_mps = 0.0;  // relative to the head, of what a step starts from
  uint32_t solves = 1;         // linear solves per step
  uint32_t order = 2;          // of the time integration
  bool is_sag_free = false;    // the loaded shape is the equilibrium under gravity
};

RodParameters read_rod_parameters(const SolverParameters& parameters);

SolverRow direct_rod_row();

Result<std::unique_ptr<Solver>> make_direct_rod_gpu(const SolverParameters& parameters,
                                                    const GpuSolverContext& context);
std::unique_ptr<Solver> make_direct_rod_reference(const SolverParameters& parameters);

}  // namespace strandcast

// mass_spring: point masses joined by springs, forces and units of physics (Zappe 2020, 2.2.1; Sams 2014
// sections 3.1 and 3.2; Woodhouse 2017, 2.1.1 and 2.1.2; Selle, Lentine, Fedkiw, A Mass Spring Model for Hair
// Simulation, SIGGRAPH 2008, sections 3 and 4). With e_i the edge before vertex i, l_i its rest length, L_i =
// max(l_i, shortest segment), t_i its direction:
//   mass      density (L_i + L_(i+1)) / 2 per vertex, half a segment's at the tip
//   stretch   k / 2 (|e_i| - l_i)^2 with a damper c along the spring; Sams's damper takes the whole relative
//             velocity and so brakes a strand that only turns
//   bend      angular spring K / 2 |s_i t_i - s_(i-1) u_i|^2 per joint, s_i t_i = e_i / L_i + (1 - l_i /
//             L_i) t_i: the angle to the rest shape as its chord 2 sin(angle / 2), within 1 % up to 0.49 rad.
//             u_i is where t_i would rest: its groomed direction, turned by the smallest rotation of the edge
//             before from the groom. A frame carried along the strand would keep twist better, but its forces
//             belong to no energy: a limp curl danced at 2 m/s for ever. 2 K at the clamp, where half a
//             segment bends
//   altitude  a / 2 (V_i - V_i rest)^2, V_i = e_(i-2) . (e_(i-1) x e_i) over the square of the longest L: the
//             altitude of the tetrahedron of four vertices over a right-angled base. It tells a curl from its
//             mirror image and keeps it from collapsing (Selle's altitude springs, with one smooth spring per
//             tetrahedron for the switching among seven)
// Per-vertex forces (drag, pull to the groom) are implicit in every integrator: with p where they alone would
// take a vertex, s = 1 + h (drag + h pull),
//   0 symplectic Euler   v' = v_p + h f(x) / (m s),  x' = x + h v'
//   1 Verlet             the same with f at x + h v / 2 and x' = x + h (v + v') / 2: the points where f is
//                        taken obey Sams's x(t + h) = 2 x(t) - x(t - h) + a h^2
//   2 backward Euler     m s (x' - p) = h^2 f(x'), by Newton's method from the unchanged motion,
//                        with the lengths that the springs have; springs under pressure without their
//                        negative stiffness, so that the matrix stays positive
// Then segments longer or shorter than the limit are cut to it from root to tip (Selle section 4.2), and
// colliders turn segments out. Strands held at both ends are not cut.
//
// In backward Euler a spring counts as no stiffer than kMaxImplicitRatio times what inertia resists with in
// the substep: float would lose the inertia beside it, and at that ratio a strand of 64 vertices hangs 0.1 %
// long.
#pragma once

#include "server/sim/solver_registry.h"

namespace strandcast {

enum class SpringIntegrator : uint32_t { SymplecticEuler = 0, Verlet = 1, BackwardEuler = 2 };

/// What both versions of the solver read from the parameters.
struct MassSpringParameters {
  SpringIntegrator integrator = SpringIntegrator::BackwardEuler;
  uint32_t solves = 1;               // Newton steps of backward Euler
  double stretch_mps2 = 0.0;         // stiffness over mass per length
  double stretch_damping_mps = 0.0;  // damper over mass per length
  double bend_m3ps2 = 0.0;           // angular stiffness over mass per length
  double altitude_mps2 = 0.0;        // stiffness over mass per length
  double shortest_segment_m = 0.0;   // for mass and leverage
  double stretch_limit = 0.0;        // relative
};

/// Largest ratio of a spring to inertia, h^2 k / m, in backward Euler.
inline constexpr double kMaxImplicitRatio = 3e4;
// Largest curvature of the energies over that of a stretch spring with the same constant (times L^2 for
// bending): |x_(i-1) - 2 x_i + x_(i+1)|^2 against |x_i - x_(i-1)|^2 on a zigzag, 16 to 4; three unit
// gradients in each of three tetrahedra.
inline constexpr double kBendPerStretch = 4.0;
inline constexpr double kAltitudePerStretch = 9.0;

MassSpringParameters read_mass_spring(const SolverParameters& parameters);

/// Largest h^2 k / m + 2 h c / m of the stiffest combination of springs on the lightest vertex; explicit
/// steps are stable up to 1. With m = density x shortest segment, sum |x_i - x_(i-1)|^2 <= 4 m^-1 sum m_i
/// |x_i|^2. So the square of the highest frequency is at most 4 (k + 4 K / L^2 + 9 a) / m. The roots of
/// z^2 - (2 - h d - h^2 w^2) z + 1 - h d lie inside the unit circle where h^2 w^2 + 2 h d < 4, d = 4 c / m.
double explicit_load(const MassSpringParameters& parameters, double substep_s);

SolverRow mass_spring_row();

std::unique_ptr<Solver> make_mass_spring_reference(const SolverParameters& parameters);

}  // namespace strandcast

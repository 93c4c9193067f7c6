// super_helix: a strand as a few helical pieces. Every element has one curvature about either axis of the
// material frame and one twist; they are the unknowns, so the centre line is inextensible by construction.
// Vertices are carried along by the centre line: each keeps its place in the material frame at its arc
// length, so any groom is kept exactly. Reference only: in double, on one thread, dense in the unknowns of a
// strand.
//
// A step of backward Euler is the shape q of least energy
//   sum of m_i c_i |x_i(q) - y_i|^2 / 2 + h^2 sum of L_e (q_e - q0_e) B (q_e - q0_e) / 2 + contacts.
// B is (EI, EI, GJ) over the mass per length, y_i where forces alone would take vertex i, c_i = 1 + h (drag +
// h pull). It is found by Newton's method, with the second derivative of x(q) where that is positive, and a
// line search.
// Bertails et al. 2006 step the same unknowns with a semi-implicit scheme; mass sits at the vertices here as
// in the other models, half of each edge's at either end. Colliders push with a penalty.
#pragma once

#include "server/sim/solver_registry.h"

namespace strandcast {

SolverRow super_helix_row();

std::unique_ptr<Solver> make_super_helix_reference(const SolverParameters& parameters);

}  // namespace strandcast

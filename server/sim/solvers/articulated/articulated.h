// articulated: a strand as a serial chain of rigid segments with ball joints, by the articulated-body method.
// Unknowns are how far the segments turn, so lengths are exact by construction. Everything is divided by the
// mass per length; half of every segment's mass sits at either end, none in between.
//
// A step of backward Euler is the shape of least energy
//   sum of m_i c_i |x_i - y_i|^2 / 2 + h^2 (bending + twist),   x_i = root + sum of l_j t_j,
// with y_i where forces alone would take vertex i and c_i = 1 + h (drag + h pull). Every solve is one Newton
// step for it from the shape so far, which starts from the motion going on:
// Inertia of what is beyond a joint, as the joint feels it, is summed from the tip to the root; with the
// force F on it a segment resists turning by l F.t more, like a pendulum (never less: the matrix stays
// positive). Bending: EI / l times the angle theta to the rest direction, which turns with the segment
// before. Twist: GJ / l times 2 tan(tau / 2), tau the spin between the two frames beyond the smallest
// rotation. Damping: both lead by a time, on the turn of one segment against the other during the step.
//
// Segments do not resist spinning by inertia: twist runs along a hair in less than a millisecond, so it is
// always in balance. Spins are kept against the frame that is carried along from the clamp without twist.
#pragma once

#include "server/sim/solver_registry.h"

namespace strandcast {

SolverRow articulated_row();

std::unique_ptr<Solver> make_articulated_reference(const SolverParameters& parameters);

}  // namespace strandcast

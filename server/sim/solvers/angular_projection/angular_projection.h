// angular_projection: every segment has two angles, in two planes through it, and each angle its own scalar
// equation of angular momentum (Anjyo, Usami, Kurihara 1992). Segments are taken one after the other, from
// root to tip and back, so a step is O(n) without any matrix, and lengths are exact. Equation per mass per
// length in each plane by backward Euler, for segment i of length l with the mass m of its end vertex and all
// beyond:
//   (m l^2 + h^2 (l T + K_i + K_(i+1))) turn = moment of F - moments of the joints at both ends.
// F is the force on the end vertex and all beyond, given what the other segments did so far, T its part along
// the segment, K the stiffness EI / l of the joints.
//
// Against the paper: a segment carries what is beyond it, not only itself, so that a strand at rest hangs in
// balance. Angles are small turns in planes that go with the segment and its frame, not polar angles, so
// there is no pole and a turned scene gives the turned motion. Natural bends come from the groom; the rest
// direction of a segment turns with the one before.
//
// There and back, because that is stable at any step. A sweep changes the strand by B times the gradient,
// with B symmetric and below the inverse of the second derivative. So a mode's factor per step has the
// square 1 - (its share) < 1. From root to tip alone B is not symmetric, and strands of 16 vertices never
// come to rest.
//
// Known faults that stay: a segment turns as if those beyond only moved along with it, which makes it too
// heavy, so a strand falls and swings too slowly unless the sweep is repeated; without end it is the
// articulated chain. There is no twist (Woodhouse 2017, section 2.1.1).
#pragma once

#include "server/sim/solver_registry.h"

namespace strandcast {

SolverRow angular_projection_row();

std::unique_ptr<Solver> make_angular_projection_reference(const SolverParameters& parameters);

}  // namespace strandcast

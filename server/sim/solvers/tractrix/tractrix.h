// Models made of the tractrix step: moving the head of a rigid segment, its tail goes along the curve that a
// weight dragged on a string draws. Lengths are kept, and a movement dies out along the strand.
//
//   tractrix_emulation  every vertex in turn goes where its forces take it and drags those on both sides
//                       along; then the root is pulled back to the head and the strand follows. Velocities
//                       are the ways made in the step, so that they have in them what the vertices did to
//                       each other. Zappe 2020, 3.0.1, algorithm 3.
//   tractrix_split      only the last free vertex has forces and drags the strand, which is pulled back to
//   its
//                       root; the strand that is shown has each segment turned from there towards the groomed
//                       one by a share of the angle. The leader's velocity is the way left after the pull
//                       back. Zappe 2020, 3.0.2, algorithm 4.
// Source: Zappe 2020. Deviations: forces, pull to the groomed shape, colliders and the velocity correction
// are those of the other models (predict(), place() and finish_velocity() of
// server/sim/reference_strands.h); colliders and a pinned tip act while the strand is pulled back, so that
// what they move drags the rest along; all strands have the same order.
//
// What the published form lacks, to first order of the step: a vertex moved across its neighbours' segments
// does not move them, one moved along them moves all alike, and those that come later go to their own places
// anyway. So the moves leave every vertex where its forces took it, whatever the order, and the pull back is
// Follow-The-Leader: nothing of a follower reaches its leader, and weight that no style carries turns every
// segment towards hanging. The random order is left as a shiver. Hence the cures, each a parameter: sag_free,
// s_damping, and random_order = 0.
#pragma once

#include "server/sim/solver_registry.h"

namespace strandcast {

SolverRow tractrix_emulation_row();
SolverRow tractrix_split_row();

std::unique_ptr<Solver> make_tractrix_emulation_reference(const SolverParameters& parameters);
std::unique_ptr<Solver> make_tractrix_split_reference(const SolverParameters& parameters);

}  // namespace strandcast

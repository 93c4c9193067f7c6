// Applies the artist's factors of stiffness and friction (common/scene/hair_controls.h) to the parameters of
// the running solver. Pure logic, any thread.
#pragma once

#include "common/kernels/volume/volume_desc.h"
#include "server/sim/solver_registry.h"

namespace strandcast {

/// Multiplies every parameter of a row that resists bending or pulls to the groomed shape by `times`, within
/// the row's ranges. `complete` must have all parameters. A style margin is scaled too, or rods would be
/// stiffened back. 1 changes nothing.
SolverParameters stiff_parameters(const SolverRow& row, SolverParameters complete, double times);
/// Multiplies the friction between strands by `times`.
VolumeDesc held_volume(VolumeDesc volume, double times);

}  // namespace strandcast

// Stiffness and friction of hair as artists set them (common/scene/hair_controls.h), in the terms of whatever
// solver runs. Pure logic, any thread.
#pragma once

#include "common/kernels/volume/volume_desc.h"
#include "server/sim/solver_registry.h"

namespace strandcast {

/// Complete parameters of a row with everything that resists bending, or pulls to the groomed shape, so many
/// times as stiff, within the row's ranges. A style margin goes along, so that rods are not stiffened back to
/// where they were. 1 changes nothing.
SolverParameters stiff_parameters(const SolverRow& row, SolverParameters complete, double times);
/// So much more friction between strands, where there is any.
VolumeDesc held_volume(VolumeDesc volume, double times);

}  // namespace strandcast

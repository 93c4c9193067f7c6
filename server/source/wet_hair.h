// Wet hair, as far as it moves otherwise: water makes strands heavier and lets them lie closer and hold on to
// each other. How it looks is the renderer's. Pure logic, any thread.
#pragma once

#include "common/kernels/volume/volume_desc.h"
#include "server/sim/solver_registry.h"

namespace strandcast {

/// Hair that drips weighs so many times what it weighs dry.
inline constexpr double kWetMass = 2.5;
/// Dripping hair may lie so many times as dense as in the groom, and takes on so much more of its neighbours'
/// motion in a second.
inline constexpr double kWetDensity = 3.0;
inline constexpr double kWetFrictionPerS = 60.0;

/// What a scene's strands move by: its parameters, complete, for hair as wet as it is drawn
/// (look.shading.wetness) and as stiff as `hair` says. As complete_parameters().
Result<SolverParameters> moving_parameters(const SolverRow& row, const SceneDesc& scene);
/// Whether another solver, or one of other parameters, is needed.
bool moves_otherwise(const SceneDesc& a, const SceneDesc& b);

/// Complete parameters of a row as they are when hair is so wet, 0 .. 1: what is a rate or a stiffness per
/// mass falls as the mass grows, within the row's ranges. 0 changes nothing. (Document 002, section 4.1.)
SolverParameters wet_parameters(const SolverRow& row, SolverParameters complete, double wetness);
/// Likewise of a volume that acts; one that does not stays so.
VolumeDesc wet_volume(VolumeDesc volume, double wetness);
/// What strands of these moving_parameters() do to each other, with the friction that `hair` says: their air
/// goes by the hair of a model that knows its radius and density.
VolumeDesc moving_volume(const SceneDesc& scene, const SolverParameters& moving);

}  // namespace strandcast

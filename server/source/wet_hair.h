// Effect of wetness on motion: water makes strands heavier, lets them lie closer and makes them stick
// together. The renderer handles its look. Pure logic, any thread.
#pragma once

#include "common/kernels/volume/volume_desc.h"
#include "server/sim/solver_registry.h"

namespace strandcast {

/// Mass of dripping hair relative to dry hair.
inline constexpr double kWetMass = 2.5;
/// Rest density of dripping hair relative to the groom, and the additional friction between neighbours, 1/s.
inline constexpr double kWetDensity = 3.0;
inline constexpr double kWetFrictionPerS = 60.0;

/// Returns the complete solver parameters of a scene's strands, adjusted for wetness (look.shading.wetness)
/// and for the stiffness in `hair`. Errors as complete_parameters().
Result<SolverParameters> moving_parameters(const SolverRow& row, const SceneDesc& scene);
/// Returns whether two scenes need different solvers or parameters.
bool moves_otherwise(const SceneDesc& a, const SceneDesc& b);

/// Adjusts a row's complete parameters to hair of this wetness (0 .. 1): rates and stiffnesses per mass fall
/// as the mass grows, within the row's ranges. 0 changes nothing.
SolverParameters wet_parameters(const SolverRow& row, SolverParameters complete, double wetness);
/// Adjusts a volume to this wetness; an inactive volume stays inactive.
VolumeDesc wet_volume(VolumeDesc volume, double wetness);
/// Returns the forces between strands for these moving_parameters(), with the friction in `hair`. Their air
/// uses the radius and density of models that have them.
VolumeDesc moving_volume(const SceneDesc& scene, const SolverParameters& moving);

}  // namespace strandcast

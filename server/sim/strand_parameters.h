// Parameters that the Follow-The-Leader solvers share, with their table entries. Plain data, any thread.
#pragma once

#include <vector>

#include "server/sim/solver_registry.h"

namespace strandcast {

/// Pull to the groomed shape from which on it carries the whole weight of a sag-free groom; a weaker pull
/// carries its share, so a limp strand falls. At this pull a strand that sags would give way by half a metre.
inline constexpr double kSupportStiffnessPerS2 = 20.0;

struct StrandParameters {
  double s_damping = 0.0;               // share of the velocity correction, 0..1
  double air_drag_per_s = 0.0;          // rate at which a strand takes on the air's velocity
  double style_stiffness_per_s2 = 0.0;  // pull to the groomed shape at the root
  double style_tip_share = 0.0;         // of that pull, what is left at the tip
  double sag_free = 0.0;                // share of the groom's gravity that the pull carries, 0..1
  double collider_friction = 0.0;       // Coulomb coefficient
  double max_speed_mps = 0.0;           // relative to the head
};

/// Table entries of the shared parameters, to which a solver appends its own.
std::vector<SolverParameterInfo> shared_parameter_infos();

/// Reads the shared parameters out of a completed map.
StrandParameters read_strand_parameters(const SolverParameters& parameters);

}  // namespace strandcast

// Parameters that the Follow-The-Leader solvers share, with their table entries. Plain data, any thread.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "common/kernels/step_block.h"
#include "server/sim/solver_registry.h"

namespace strandcast {

/// Table entries of the shared parameters, to which a solver appends its own.
std::vector<SolverParameterInfo> shared_parameter_infos();
/// Those of them that a model without the velocity correction has.
std::vector<SolverParameterInfo> uncorrected_parameter_infos();

/// What cures dynamic Follow-The-Leader of two faults that 003 section 5.2 reports; not all solvers have
/// both. The jitter under fast reversals: a follower that is nearer than its segment's length is pushed away,
/// and the correction then thrusts its leader the other way, as no hair does: it buckles. The default is the
/// published form all the same, because limp strands that stand against gravity do not come to rest without
/// thrusts.
SolverParameterInfo thrust_share_info();
/// The same motion in all strands: hairs differ in thickness. With f the thickness of a strand over the mean,
/// the pull per mass to the groomed shape goes with f^2 (bending stiffness f^4, mass f^2), the drag of the
/// air per mass with 1 / f^2.
SolverParameterInfo thickness_spread_info();

/// Thickness of a strand over the mean, in [1 - spread, 1 + spread], by a hash of where its root is on the
/// head: neither the order nor the number of strands changes it.
double thickness_factor(const glm::vec3& root_in_head_m, double spread);

/// A whole number out of a completed map, rounded.
uint32_t read_count(const SolverParameters& parameters, const std::string& name);

/// Reads the shared parameters out of a completed map; what the model has not is off.
StrandParameters read_strand_parameters(const SolverParameters& parameters);

}  // namespace strandcast

// Parameters that the Follow-The-Leader solvers share, and their table entries. Plain data, any thread.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "common/kernels/step_input.h"
#include "server/sim/solver_registry.h"

namespace strandcast {

/// Returns the table entries of the shared parameters, to which a solver appends its own.
std::vector<SolverParameterInfo> shared_parameter_infos();
/// Returns the shared entries of a model without velocity correction.
std::vector<SolverParameterInfo> uncorrected_parameter_infos();

/// Parameter against two faults of dynamic Follow-The-Leader that Woodhouse 2017, 5.2 reports; not all
/// solvers have both. One is jitter under fast reversals: a follower nearer than its segment's length is
/// pushed away, and the correction then thrusts its leader backwards. Real hair would buckle instead. The
/// default is the published form, because limp strands that stand against gravity do not come to rest without
/// thrusts.
SolverParameterInfo thrust_share_info();
/// Parameter against equal motion of all strands: hairs differ in thickness. With f the thickness relative to
/// the mean, bending stiffness scales with f^4 and mass with f^2. So the pull per mass to the groomed shape
/// scales with f^2, the drag per mass with 1 / f^2.
SolverParameterInfo thickness_spread_info();

/// Returns a strand's thickness relative to the mean, in [1 - spread, 1 + spread]. It is a hash of the root's
/// position on the head, so order and number of strands do not matter.
double thickness_factor(const glm::vec3& root_in_head_m, double spread);

/// Reads a whole number from a completed map, rounded.
uint32_t read_count(const SolverParameters& parameters, const std::string& name);

/// Reads the shared parameters from a completed map; features that the model lacks are off.
StrandParameters read_strand_parameters(const SolverParameters& parameters);

}  // namespace strandcast

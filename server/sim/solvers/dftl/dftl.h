// Serial Dynamic Follow-The-Leader: one pass from root to tip per strand, exact segment lengths.
// Source: Woodhouse 2017, sections 2.1.4 (projection and velocity correction) and 4.2.3 (gpu version,
// colliders).
#pragma once

#include "server/sim/solver_registry.h"

namespace strandcast {

SolverRow dftl_row();

Result<std::unique_ptr<Solver>> make_dftl(const SolverParameters& parameters, const SolverContext& context);
std::unique_ptr<Solver> make_dftl_reference(const SolverParameters& parameters);

}  // namespace strandcast

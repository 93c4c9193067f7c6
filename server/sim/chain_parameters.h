// Parameters of the models with the bending and twist stiffness of a hair on top of the shared ones: chains
// of rigid segments and helical pieces. Plain data, any thread.
#pragma once

#include <string>
#include <vector>

#include "server/sim/solver_registry.h"
#include "server/sim/strand_parameters.h"

namespace strandcast {

struct ChainParameters {
  double bend_stiffness_m4ps2 = 0.0;   // EI / (rho A)
  double twist_stiffness_m4ps2 = 0.0;  // GJ / (rho A)
  double damping_s = 0.0;              // moments lead by this time
  uint32_t effort = 1;                 // of the row's effort parameter: solves, sweeps, elements
};

/// The shared entries that such a model has (no velocity correction), and its own without the effort.
std::vector<SolverParameterInfo> chain_parameter_infos();

/// Reads its own out of a completed map; the effort from the entry of that name, rounded.
ChainParameters read_chain_parameters(const SolverParameters& parameters, const std::string& effort_name);

/// For SolverRow::as_hair: true constants, no pull to the groomed shape, no damping, no drag.
SolverParameters chain_as_hair(const HairConstants& hair);

/// The kernel of a model of rigid segments, shaders/sim/NAME.comp on top of chain.glsl.
Result<std::unique_ptr<Solver>> make_chain_kernel(const std::string& name, const std::string& effort_name,
                                                  const SolverParameters& parameters,
                                                  const SolverContext& context);

}  // namespace strandcast

// Parameters of models with a hair's bending and twist stiffness: chains of rigid segments and helical
// pieces. They extend the shared parameters. Plain data, any thread.
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

/// Returns the shared entries that such a model has (without velocity correction) and its own, except the
/// effort parameter.
std::vector<SolverParameterInfo> chain_parameter_infos();

/// Reads these parameters from a completed map; the effort comes from the entry `effort_name`, rounded.
ChainParameters read_chain_parameters(const SolverParameters& parameters, const std::string& effort_name);

/// Returns the parameters for SolverRow::as_hair: physical constants without a pull to the groomed shape,
/// damping or drag.
SolverParameters chain_as_hair(const HairConstants& hair);

/// Makes the kernel solver of a model of rigid segments: shaders/sim/NAME.comp, which includes chain.glsl.
Result<std::unique_ptr<Solver>> make_chain_kernel(const std::string& name, const std::string& effort_name,
                                                  const SolverParameters& parameters,
                                                  const SolverContext& context);

}  // namespace strandcast

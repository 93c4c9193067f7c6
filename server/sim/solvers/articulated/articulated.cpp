#include "server/sim/solvers/articulated/articulated.h"

#include "server/sim/chain_parameters.h"

namespace strandcast {

SolverRow articulated_row() {
  SolverRow row;
  row.name = "articulated";
  row.summary = "chain of rigid segments with ball joints: exact lengths, bending and twist of a real hair";
  row.source =
      "Woodhouse, Real-Time Hair Rendering and Simulation, University of Bristol 2017, section 2.1.1 (rigid "
      "multi-body serial chain); Featherstone, Robot Dynamics Algorithms, 1984 (articulated-body method); "
      "Hadap, Magnenat-Thalmann, Modeling Dynamic Hair as a Continuum, 2001; Chang, Jin, Yu, 2002. Implicit "
      "joints and tension are ours";
  row.parameters = chain_parameter_infos();
  row.parameters.push_back({"solves", 1.0, 1.0, 8.0, "", "linear solves per step (rounded)"});
  row.effort_parameter = "solves";
  row.as_hair = [](const HairConstants& hair, double, double) { return chain_as_hair(hair); };
  row.make = [](const SolverParameters& parameters, const SolverContext& context) {
    return make_chain_kernel("articulated", "solves", parameters, context);
  };
  row.make_reference = make_articulated_reference;
  return row;
}

}  // namespace strandcast

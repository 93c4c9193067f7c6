#include "server/sim/solvers/angular_projection/angular_projection.h"

#include "server/sim/chain_parameters.h"

namespace strandcast {

SolverRow angular_projection_row() {
  SolverRow row;
  row.name = "angular_projection";
  row.summary =
      "two scalar equations of angular momentum per segment, root to tip and back: exact lengths, no twist";
  row.source =
      "Anjyo, Usami, Kurihara, A Simple Method for Extracting the Natural Beauty of Hair, SIGGRAPH 1992; "
      "Woodhouse, Real-Time Hair Rendering and Simulation, University of Bristol 2017, section 2.1.1 "
      "(one-dimensional projective equations). Planes that go with the segment, the load of what is beyond "
      "and backward Euler are ours";
  row.parameters = chain_parameter_infos();
  std::erase_if(row.parameters, [](const SolverParameterInfo& info) { return info.name == "poisson_ratio"; });
  row.parameters.push_back(
      {"sweeps", 4.0, 1.0, 64.0, "", "times all segments are taken there and back per step (rounded)"});
  row.effort_parameter = "sweeps";
  row.as_hair = [](const HairConstants& hair, double, double) {
    SolverParameters parameters = chain_as_hair(hair);
    parameters.erase("poisson_ratio");
    return parameters;
  };
  row.make = [](const SolverParameters& parameters, const SolverContext& context) {
    return make_chain_kernel("angular_projection", "sweeps", parameters, context);
  };
  row.make_reference = make_angular_projection_reference;
  return row;
}

}  // namespace strandcast

#include "server/sim/kernel_solver.h"
#include "server/sim/solvers/dftl/dftl.h"
#include "server/sim/strand_parameters.h"

namespace strandcast {

Result<std::unique_ptr<Solver>> make_dftl(const SolverParameters& parameters, const SolverContext& context) {
  StrandKernelDesc desc;
  desc.name = "dftl";
  desc.shader_path = "sim/dftl.comp";
  return StrandKernel::make(std::move(desc), read_strand_parameters(parameters), context);
}

SolverRow dftl_row() {
  SolverRow row;
  row.name = "dftl";
  row.summary = "serial Dynamic Follow-The-Leader: one pass from root to tip, exact lengths";
  row.source =
      "Woodhouse, Real-Time Hair Rendering and Simulation, University of Bristol 2017, sections 2.1.4 "
      "(equations of "
      "d_i and v_i) and 4.2.3 (gpu version)";
  row.parameters = shared_parameter_infos();
  row.parameters.push_back(thrust_share_info());
  row.parameters.push_back(thickness_spread_info());
  row.make = make_dftl;
  row.make_reference = make_dftl_reference;
  return row;
}

}  // namespace strandcast

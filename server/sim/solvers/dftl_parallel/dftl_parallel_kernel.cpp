#include <cmath>

#include "server/sim/kernel_solver.h"
#include "server/sim/solvers/dftl_parallel/dftl_parallel.h"
#include "server/sim/strand_parameters.h"

namespace strandcast {

Result<std::unique_ptr<Solver>> make_dftl_parallel(const SolverParameters& parameters,
                                                   const SolverContext& context) {
  StrandKernelDesc desc;
  desc.name = "dftl_parallel";
  const bool is_software = context.executor->info().is_software;
  const KernelForm suiting = is_software ? KernelForm::PerStrand : KernelForm::PerVertex;
  desc.is_per_vertex = (context.form == KernelForm::Auto ? suiting : context.form) == KernelForm::PerVertex;
  desc.shader_path = desc.is_per_vertex ? "sim/dftl_parallel.comp" : "sim/dftl_odd_even.comp";
  desc.constants = {{"u_iterations", read_count(parameters, "iterations")},
                    {"u_has_exact_length", parameters.at("exact_length") >= 0.5 ? 1u : 0u}};
  return StrandKernel::make(std::move(desc), read_strand_parameters(parameters), context);
}

SolverRow dftl_parallel_row() {
  SolverRow row;
  row.name = "dftl_parallel";
  row.summary = "odd-even Dynamic Follow-The-Leader: all vertices at once, a few iterations";
  row.source =
      "Woodhouse, Real-Time Hair Rendering and Simulation, University of Bristol 2017, section 4.2.3 "
      "(optimised_gpu "
      "version)";
  row.parameters = shared_parameter_infos();
  row.parameters.push_back(thrust_share_info());
  row.parameters.push_back(thickness_spread_info());
  row.parameters.push_back({"iterations", kDefaultOddEvenIterations, 1.0, kMaxOddEvenIterations, "",
                            "times the odd and the even vertices follow their leaders (rounded)"});
  row.parameters.push_back(
      {"exact_length", 1.0, 0.0, 1.0, "",
       "1 = lay the segments end to end with exact lengths at the end, 0 = as iterated"});
  row.effort_parameter = "iterations";
  row.make = make_dftl_parallel;
  row.make_reference = make_dftl_parallel_reference;
  return row;
}

}  // namespace strandcast

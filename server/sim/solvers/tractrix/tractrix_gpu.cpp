#include "server/sim/solvers/tractrix/tractrix.h"
#include "server/sim/strand_kernel.h"
#include "server/sim/strand_parameters.h"
#include "shaders/shared/limits.h"

namespace strandcast {
namespace {

constexpr double kMaxSeed = 65535.0;  // exact in the float that carries it

Result<std::unique_ptr<Solver>> make_emulation_gpu(const SolverParameters& parameters,
                                                   const GpuSolverContext& context) {
  StrandKernelDesc desc;
  desc.name = "tractrix_emulation";
  desc.shader_path = "sim/tractrix_emulation.comp";
  desc.local_size = shader::kStrandLocalSize;
  desc.uniforms["u_order"] =
      glm::vec4(glm::dvec4(parameters.at("order_seed"), parameters.at("random_order"), 0.0, 0.0));
  return StrandKernel::make(std::move(desc), read_strand_parameters(parameters), context);
}

}  // namespace

SolverRow tractrix_emulation_row() {
  SolverRow row;
  row.name = "tractrix_emulation";
  row.summary =
      "every vertex moves in turn and drags the others along tractrix curves; exact lengths, n^2 steps per "
      "strand of n vertices";
  row.source =
      "Zappe, Simulation of hair with the Tractrix curve, Ravensburg-Weingarten 2020, section 3.0.1, "
      "algorithm 3; step: section 2.2.3, after Sreenivasan, Goel and Ghosal 2010";
  row.parameters = shared_parameter_infos();
  row.parameters.push_back({"random_order", 0.0, 0.0, 1.0, "",
                            "1 = vertices move in a new random order each step, as published, and shiver; 0 "
                            "= from the tip to the root"});
  row.parameters.push_back({"order_seed", 1.0, 0.0, kMaxSeed, "", "of the random order"});
  // 64 vertices in 0.25 m, a head that moves by two segments a step: measured 0.011 m after six steps.
  row.folding_spread_m = 0.03;
  row.make_gpu = make_emulation_gpu;
  row.make_reference = make_tractrix_emulation_reference;
  return row;
}

}  // namespace strandcast

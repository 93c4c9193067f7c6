#include "server/sim/kernel_solver.h"
#include "server/sim/solvers/tractrix/tractrix.h"
#include "server/sim/strand_parameters.h"

namespace strandcast {
namespace {

constexpr double kDefaultStyleMix = 0.3;
constexpr double kDefaultStyleReturnPerS = 0.5;
constexpr double kMaxSeed = 65535.0;  // exact in the float that carries it

Result<std::unique_ptr<Solver>> make_emulation(const SolverParameters& parameters,
                                               const SolverContext& context) {
  StrandKernelDesc desc;
  desc.name = "tractrix_emulation";
  desc.shader_path = "sim/tractrix_emulation.comp";
  desc.constants = {{"u_order_seed", static_cast<uint32_t>(parameters.at("order_seed"))},
                    {"u_has_random_order", parameters.at("random_order") >= 0.5 ? 1u : 0u}};
  return StrandKernel::make(std::move(desc), read_strand_parameters(parameters), context);
}

Result<std::unique_ptr<Solver>> make_split(SolverParameters parameters, const SolverContext& context) {
  StrandKernelDesc desc;
  desc.name = "tractrix_split";
  desc.shader_path = "sim/tractrix_split.comp";
  desc.has_offset = true;
  desc.constants = {{"u_style_mix", parameters.at("style_mix")},
                    {"u_style_return", parameters.at("style_return_per_s")}};
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
  row.make = make_emulation;
  row.make_reference = make_tractrix_emulation_reference;
  return row;
}

SolverRow tractrix_split_row() {
  SolverRow row;
  row.name = "tractrix_split";
  row.summary =
      "only the tip has forces and drags the strand along tractrix curves; what is shown is mixed with the "
      "style by one number";
  row.source =
      "Zappe, Simulation of hair with the Tractrix curve, Ravensburg-Weingarten 2020, section 3.0.2, "
      "algorithm 4; step: section 2.2.3, after Sreenivasan, Goel and Ghosal 2010";
  row.parameters = uncorrected_parameter_infos();
  row.parameters.push_back({"style_mix", kDefaultStyleMix, 0.0, 1.0, "",
                            "share of the turn of every segment towards the groomed one: 0 = all motion, 1 = "
                            "all style"});
  row.parameters.push_back({"style_return_per_s", kDefaultStyleReturnPerS, 0.0, 1000.0, "1/s",
                            "rate at which the dragged strand takes on the style; 0 = never, as published"});
  // The style takes back slowly what the tip's weight, when the style does not carry it, pulls down; a strand
  // that stands against it folds over and over.
  row.comes_to_rest = false;
  row.make = make_split;
  row.make_reference = make_tractrix_split_reference;
  return row;
}

}  // namespace strandcast

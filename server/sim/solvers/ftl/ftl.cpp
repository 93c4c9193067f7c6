#include "server/sim/solvers/ftl/ftl.h"

#include "server/sim/kernel_solver.h"
#include "server/sim/reference_strands.h"
#include "server/sim/strand_parameters.h"

namespace strandcast {
namespace {

class FtlReference final : public ReferenceStrands {
 public:
  explicit FtlReference(const SolverParameters& parameters)
      : ReferenceStrands(read_strand_parameters(parameters)) {}

 private:
  void solve(ReferenceStrand& strand) const override {
    for (uint32_t i = layout().pinned_root_count; i < layout().tail_begin(); ++i) place(strand, i);
  }
};

// The serial dynamic kernel without its velocity correction is the static form.
Result<std::unique_ptr<Solver>> make_ftl(const SolverParameters& parameters, const SolverContext& context) {
  StrandKernelDesc desc;
  desc.name = "ftl";
  desc.shader_path = "sim/dftl.comp";
  return StrandKernel::make(std::move(desc), read_strand_parameters(parameters), context);
}

}  // namespace

SolverRow ftl_row() {
  SolverRow row;
  row.name = "ftl";
  row.summary =
      "static Follow-The-Leader: one pass, exact lengths; swings as if each vertex carried no others and "
      "damps unevenly";
  row.source =
      "Woodhouse, Real-Time Hair Rendering and Simulation, University of Bristol 2017, section 2.1.4 "
      "(equations of dv, p_i and d_i), after Brown, Latombe and Montgomery 2004";
  row.parameters = uncorrected_parameter_infos();
  row.parameters.push_back(thickness_spread_info());
  // The segments are a chain of followers that no reaction holds back: what one does, the next does larger.
  row.comes_to_rest = false;
  row.bears_volume = false;
  row.make = make_ftl;
  row.make_reference = [](const SolverParameters& parameters) {
    return std::make_unique<FtlReference>(parameters);
  };
  return row;
}

}  // namespace strandcast

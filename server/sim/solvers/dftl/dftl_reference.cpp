#include "server/sim/reference_strands.h"
#include "server/sim/solvers/dftl/dftl.h"

namespace strandcast {
namespace {

class DftlReference final : public ReferenceStrands {
 public:
  explicit DftlReference(const SolverParameters& parameters)
      : ReferenceStrands(read_strand_parameters(parameters)) {}

 private:
  // Each vertex follows the one placed just before it, so one pass is exact.
  void solve(ReferenceStrand& strand) const override {
    for (uint32_t i = layout().pinned_root_count; i < layout().tail_begin(); ++i) place(strand, i);
  }
};

}  // namespace

std::unique_ptr<Solver> make_dftl_reference(const SolverParameters& parameters) {
  return std::make_unique<DftlReference>(parameters);
}

}  // namespace strandcast

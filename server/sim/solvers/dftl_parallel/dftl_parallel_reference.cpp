#include <cmath>

#include "server/sim/reference_strands.h"
#include "server/sim/solvers/dftl_parallel/dftl_parallel.h"

namespace strandcast {
namespace {

class DftlParallelReference final : public ReferenceStrands {
 public:
  explicit DftlParallelReference(const SolverParameters& parameters)
      : ReferenceStrands(read_strand_parameters(parameters)),
        iterations_(read_count(parameters, "iterations")),
        has_exact_length_(parameters.at("exact_length") >= 0.5) {}

 private:
  void solve(ReferenceStrand& strand) const override {
    // A pinned tail fixes the sum of the segments, which laying them end to end would shift.
    const bool is_tip_free = layout().pinned_tail_count == 0;
    if (is_tip_free) restore_lengths(strand);
    for (uint32_t iteration = 0; iteration < iterations_; ++iteration) {
      place_every_second(strand, 1);
      place_every_second(strand, 0);
    }
    if (is_tip_free && has_exact_length_) restore_lengths(strand);
  }

  void place_every_second(ReferenceStrand& strand, uint32_t parity) const {
    for (uint32_t i = layout().pinned_root_count; i < layout().tail_begin(); ++i) {
      if (i % 2 == parity) place(strand, i);
    }
  }

  // Keeps the direction of every segment and lays them end to end with their rest lengths.
  void restore_lengths(ReferenceStrand& strand) const {
    const std::vector<glm::dvec3> before = strand.placed_m;
    for (uint32_t i = layout().pinned_root_count; i < layout().vertex_count; ++i) {
      const glm::dvec3 segment = before[i] - before[i - 1];
      const double length = glm::length(segment);
      const glm::dvec3 rest_segment = strand.target_m[i] - strand.target_m[i - 1];
      const glm::dvec3 kept = length > 0.0 ? segment * (strand.segment_m[i] / length) : rest_segment;
      strand.placed_m[i] = strand.placed_m[i - 1] + kept;
    }
  }

  uint32_t iterations_;
  bool has_exact_length_;
};

}  // namespace

std::unique_ptr<Solver> make_dftl_parallel_reference(const SolverParameters& parameters) {
  return std::make_unique<DftlParallelReference>(parameters);
}

}  // namespace strandcast

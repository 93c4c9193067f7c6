#include <cmath>

#include "common/base/hash.h"
#include "server/sim/reference_strands.h"
#include "server/sim/solvers/tractrix/tractrix.h"
#include "server/sim/solvers/tractrix/tractrix_step.h"

namespace strandcast {
namespace {

class TractrixReference : public ReferenceStrands {
 protected:
  explicit TractrixReference(const SolverParameters& parameters)
      : ReferenceStrands(read_strand_parameters(parameters)) {}

  uint32_t first() const { return layout().pinned_root_count; }
  uint32_t end() const { return layout().tail_begin(); }

  /// Moves one vertex of the chain first - 1 .. end - 1 to `place`; all others follow.
  void drag(std::vector<glm::dvec3>& point, const std::vector<double>& segment_m, uint32_t vertex,
            const glm::dvec3& place) const {
    const std::vector<glm::dvec3> before = point;
    point[vertex] = place;
    for (uint32_t i = vertex; i + 1 > first(); --i)
      point[i - 1] = tractrix_followed(before[i], point[i], before[i - 1], segment_m[i]);
    for (uint32_t i = vertex + 1; i < end(); ++i)
      point[i] = tractrix_followed(before[i - 1], point[i - 1], before[i], segment_m[i]);
  }

  /// Brings the chain's root to the head, with colliders and a pinned tip acting on the way.
  void pull_back(ReferenceStrand& strand, const std::vector<glm::dvec3>& point) const {
    for (uint32_t i = first(); i < end(); ++i) {
      const glm::dvec3 predicted = strand.predicted_m[i];
      strand.predicted_m[i] =
          tractrix_followed(point[i - 1], strand.placed_m[i - 1], point[i], strand.segment_m[i]);
      place(strand, i);
      strand.predicted_m[i] = predicted;
    }
  }
};

class EmulationReference final : public TractrixReference {
 public:
  explicit EmulationReference(const SolverParameters& parameters)
      : TractrixReference(parameters),
        seed_(static_cast<uint32_t>(parameters.at("order_seed"))),
        is_random_(parameters.at("random_order") >= 0.5) {}

 private:
  void solve(ReferenceStrand& strand) const override {
    if (end() <= first()) return;
    std::vector<glm::dvec3> point = strand.old_m;
    for (const uint32_t vertex : order()) drag(point, strand.segment_m, vertex, strand.predicted_m[vertex]);
    pull_back(strand, point);
  }

  std::vector<uint32_t> order() const {
    const uint32_t count = end() - first();
    std::vector<uint32_t> vertices = shuffled_order(count, mix_u32(seed_ + mix_u32(step_index())));
    for (uint32_t k = 0; k < count; ++k) vertices[k] = is_random_ ? first() + vertices[k] : end() - 1 - k;
    return vertices;
  }

  uint32_t seed_;
  bool is_random_;
};

}  // namespace

std::unique_ptr<Solver> make_tractrix_emulation_reference(const SolverParameters& parameters) {
  return std::make_unique<EmulationReference>(parameters);
}

}  // namespace strandcast

#include <algorithm>
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

// The state is the strand that is shown; the memory is the way from there to the one that is dragged.
class SplitReference final : public TractrixReference {
 public:
  explicit SplitReference(const SolverParameters& parameters)
      : TractrixReference(parameters),
        style_mix_(parameters.at("style_mix")),
        style_return_per_s_(parameters.at("style_return_per_s")) {}

 private:
  size_t memory_size() const override { return size_t{3} * layout().vertex_count; }

  void turn_memory(const glm::dquat& turn) override {
    for (uint32_t s = 0; s < layout().strand_count; ++s) {
      const std::span<double> memory = memory_of(s);
      for (size_t i = 0; i < memory.size(); i += 3) {
        const glm::dvec3 turned = turn * glm::dvec3(memory[i], memory[i + 1], memory[i + 2]);
        for (int axis = 0; axis < 3; ++axis) memory[i + static_cast<size_t>(axis)] = turned[axis];
      }
    }
  }

  void solve(ReferenceStrand& strand) const override {
    if (end() <= first()) return;
    const std::vector<glm::dvec3> shown_before = strand.old_m;
    const uint32_t leader = end() - 1;
    for (uint32_t i = first(); i < end(); ++i)
      strand.old_m[i] += glm::dvec3(strand.memory[3 * i], strand.memory[3 * i + 1], strand.memory[3 * i + 2]);
    std::vector<glm::dvec3> point = strand.old_m;
    drag(point, strand.segment_m, leader, predict(strand, leader));
    pull_back(strand, point);
    const std::vector<glm::dvec3> dragged = strand.placed_m;
    leader_way_m_ = dragged[leader] - strand.old_m[leader];

    strand.old_m = shown_before;
    glm::dvec3 kept = dragged[first() - 1];
    for (uint32_t i = first(); i < end(); ++i) {
      const glm::dvec3 segment = dragged[i] - dragged[i - 1];
      const glm::dvec3 groomed = strand.target_m[i] - strand.target_m[i - 1];
      strand.predicted_m[i] =
          strand.placed_m[i - 1] + strand.segment_m[i] * mixed(segment, groomed, style_mix_);
      place(strand, i);
      const double stiffness = style_stiffness_per_s2(strand, i);
      const double turn = h_s() * style_return_per_s_ * std::min(1.0, stiffness / kSupportStiffnessPerS2);
      kept += strand.segment_m[i] * mixed(segment, groomed, turn / (1.0 + turn));
      const glm::dvec3 apart = kept - strand.placed_m[i];
      for (int axis = 0; axis < 3; ++axis) strand.memory[3 * i + axis] = apart[axis];
    }
  }

  /// Direction of a segment turned towards the groomed one by a share of the angle between them, about the
  /// normal of both.
  static glm::dvec3 mixed(const glm::dvec3& segment, const glm::dvec3& groomed, double share) {
    const double product = glm::length(segment) * glm::length(groomed);
    if (product < kTinySquaredM) return glm::length(segment) > 0.0 ? glm::normalize(segment) : groomed;
    const double angle = std::acos(std::clamp(glm::dot(segment, groomed) / product, -1.0, 1.0));
    const glm::dvec3 normal = glm::cross(segment, groomed);
    if (glm::length(normal) > kNoPlane * product)
      return glm::angleAxis(share * angle, glm::normalize(normal)) * glm::normalize(segment);
    return glm::normalize(share < 0.5 ? segment : groomed);
  }

  glm::dvec3 way_m(const ReferenceStrand& strand, uint32_t i) const override {
    return i + 1 == end() && i >= first() ? leader_way_m_ : TractrixReference::way_m(strand, i);
  }

  static constexpr double kTinySquaredM = 1e-20;
  static constexpr double kNoPlane = 1e-9;
  double style_mix_;
  double style_return_per_s_;
  mutable glm::dvec3 leader_way_m_{0.0};  // of the strand in progress
};

}  // namespace

std::unique_ptr<Solver> make_tractrix_split_reference(const SolverParameters& parameters) {
  return std::make_unique<SplitReference>(parameters);
}

std::unique_ptr<Solver> make_tractrix_emulation_reference(const SolverParameters& parameters) {
  return std::make_unique<EmulationReference>(parameters);
}

}  // namespace strandcast

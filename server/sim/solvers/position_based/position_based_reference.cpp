#include <algorithm>
#include <cmath>

#include "server/sim/reference_contact.h"
#include "server/sim/reference_strands.h"
#include "server/sim/solvers/position_based/position_based.h"
#include "server/sim/solvers/tractrix/tractrix_step.h"

namespace strandcast {
namespace {

constexpr double kTinyConstraintM = 1e-10;
constexpr double kTinyMassKg = 1e-15;

/// A distance that two vertices should have.
struct DistanceConstraint {
  uint32_t a = 0;
  uint32_t b = 0;
  double rest_m = 0.0;
  double compliance_mpn = 0.0;
  double share = 1.0;
  double multiplier = 0.0;  // N s^2
  bool is_stretch = true;
};

class PositionBasedReference final : public ReferenceStrands {
 public:
  PositionBasedReference(const SolverParameters& parameters, bool is_compliant)
      : ReferenceStrands(read_strand_parameters(parameters)),
        model_(read_position_based(parameters, is_compliant)),
        friction_(parameters.at("collider_friction")) {}

 private:
  void solve(ReferenceStrand& strand) const override {
    std::vector<DistanceConstraint> constraints = make_constraints(strand);
    std::vector<double> inverse_mass(layout().vertex_count);
    for (uint32_t i = 0; i < layout().vertex_count; ++i) inverse_mass[i] = inverse_mass_perkg(strand, i);
    leave_colliders(strand);
    const bool is_first = model_.has_tractrix_first;
    if (is_first && model_.tractrix_sweeps > 0) guess(strand);
    for (uint32_t iteration = 0; iteration < model_.iterations; ++iteration) {
      for (DistanceConstraint& constraint : constraints) project(strand, inverse_mass, constraint);
      leave_colliders(strand);
    }
    solved_m_ = strand.placed_m;
    if (!is_first && model_.tractrix_sweeps > 0) finish(strand);
  }

  /// Tractrix sweeps as a first guess for the constraints.
  void guess(ReferenceStrand& strand) const {
    if (model_.tractrix_sweeps > 1) sweep_from_tip(strand);
    const std::vector<glm::dvec3> before = strand.placed_m;
    for (uint32_t i = layout().pinned_root_count; i < layout().tail_begin(); ++i)
      strand.placed_m[i] = followed(strand, before, i - 1, i);
  }

  /// Tractrix sweeps that give what the constraints left its lengths; the velocity does not have them in it.
  void finish(ReferenceStrand& strand) const {
    if (model_.tractrix_sweeps > 1) sweep_from_tip(strand);
    const std::vector<glm::dvec3> before = strand.placed_m;
    for (uint32_t i = layout().pinned_root_count; i < layout().tail_begin(); ++i) {
      strand.predicted_m[i] = followed(strand, before, i - 1, i);
      place(strand, i);
    }
  }

  void sweep_from_tip(ReferenceStrand& strand) const {
    const std::vector<glm::dvec3> before = strand.placed_m;
    const uint32_t last = std::min(layout().tail_begin(), layout().vertex_count - 1);
    for (uint32_t i = last; i > layout().pinned_root_count; --i)
      strand.placed_m[i - 1] = followed(strand, before, i, i - 1);
  }

  /// Where the tail goes when the head has been moved, once their segment has its length.
  static glm::dvec3 followed(const ReferenceStrand& strand, const std::vector<glm::dvec3>& before,
                             uint32_t head, uint32_t tail) {
    const double segment_m = strand.segment_m[std::max(head, tail)];
    const glm::dvec3 edge = before[tail] - before[head];
    if (glm::length(edge) < kTinyConstraintM) return strand.placed_m[head];
    const glm::dvec3 fitting = before[head] + segment_m * glm::normalize(edge);
    return tractrix_followed(before[head], strand.placed_m[head], fitting, segment_m);
  }

  glm::dvec3 way_m(const ReferenceStrand& strand, uint32_t i) const override {
    return solved_m_[i] - strand.old_m[i];
  }

  std::vector<DistanceConstraint> make_constraints(const ReferenceStrand& strand) const {
    std::vector<DistanceConstraint> constraints;
    for (uint32_t i = 1; i < layout().vertex_count; ++i) {
      if (i >= 2) {
        const double span_m = glm::distance(strand.target_m[i], strand.target_m[i - 2]);
        constraints.push_back({i - 2, i, span_m, model_.bend_compliance_mpn, model_.bend_share, 0.0, false});
      }
      constraints.push_back(
          {i - 1, i, strand.segment_m[i], model_.stretch_compliance_mpn, model_.stretch_share, 0.0, true});
    }
    return constraints;
  }

  /// 1/kg; pbd has masses only up to a factor.
  double inverse_mass_perkg(const ReferenceStrand& strand, uint32_t i) const {
    if (is_pinned(i)) return 0.0;
    double length_m = 0.0;
    for (const double segment_m : strand.segment_m) length_m += segment_m;
    const double density = model_.is_compliant ? model_.linear_density_kgpm : 1.0;
    const double mass_kg = std::max(kTinyMassKg, density * length_m / (layout().vertex_count - 1));
    return i + 1 == layout().vertex_count ? 2.0 / mass_kg : 1.0 / mass_kg;
  }

  void project(ReferenceStrand& strand, const std::vector<double>& inverse_mass,
               DistanceConstraint& constraint) const {
    const double w_a = inverse_mass[constraint.a];
    const double w_b = inverse_mass[constraint.b];
    if (w_a + w_b == 0.0) return;
    const glm::dvec3 along = strand.placed_m[constraint.b] - strand.placed_m[constraint.a];
    const double length_m = glm::length(along);
    glm::dvec3 gradient = length_m > kTinyConstraintM ? along / length_m : glm::dvec3(0.0);
    if (length_m <= kTinyConstraintM && constraint.is_stretch) {
      const glm::dvec3 groomed = strand.target_m[constraint.b] - strand.target_m[constraint.a];
      if (glm::length(groomed) > kTinyConstraintM) gradient = glm::normalize(groomed);
    }
    const double error_m = length_m - constraint.rest_m;
    double push = -constraint.share * error_m / (w_a + w_b);
    if (model_.is_compliant) {
      const double scaled = constraint.compliance_mpn / (h_s() * h_s());
      push = (-error_m - scaled * constraint.multiplier) / (w_a + w_b + scaled);
      constraint.multiplier += push;
    }
    strand.placed_m[constraint.a] -= w_a * push * gradient;
    strand.placed_m[constraint.b] += w_b * push * gradient;
  }

  void leave_colliders(ReferenceStrand& strand) const {
    for (uint32_t i = 0; i < layout().vertex_count; ++i) {
      if (!is_pinned(i)) strand.placed_m[i] = outside(strand.old_m[i], strand.placed_m[i]);
    }
  }

  /// Out of the deepest collider along its normal, twice when there are several, after friction.
  glm::dvec3 outside(const glm::dvec3& old, glm::dvec3 point) const {
    for (int round = 0; round < push_rounds(input()); ++round) {
      const ReferenceSphere sphere = deepest_sphere(input(), point);
      // No way out of the very centre is shorter than another.
      if (sphere.radius_m <= 0.0 || glm::distance(point, sphere.center_m) < kTinyConstraintM) return point;
      const glm::dvec3 held =
          held_by_friction({input(), carry(), friction_}, old, point, sphere) - sphere.center_m;
      point = sphere.center_m + held * (sphere.radius_m / std::max(glm::length(held), kTinyConstraintM));
    }
    return point;
  }

  PositionBasedParameters model_;
  mutable std::vector<glm::dvec3> solved_m_;  // of the strand in progress, before its finish
  double friction_;
};

}  // namespace

std::unique_ptr<Solver> make_position_based_reference(const SolverParameters& parameters, bool is_compliant) {
  return std::make_unique<PositionBasedReference>(parameters, is_compliant);
}

}  // namespace strandcast

#include <glm/gtx/quaternion.hpp>

#include <algorithm>
#include <cmath>

#include "server/sim/directions.h"
#include "server/sim/reference_contact.h"
#include "server/sim/reference_strands.h"
#include "server/sim/solvers/shape_constraints/shape_constraints.h"

namespace strandcast {
namespace {

constexpr double kTinySine = 1e-10;

/// The vector turned by the shortest turn between two unit vectors. Opposite ones have no shortest turn: the
/// vector is mirrored.
glm::dvec3 turned(const glm::dvec3& from, const glm::dvec3& to, const glm::dvec3& vector) {
  const glm::dvec3 axis = glm::cross(from, to);
  const double sine = glm::length(axis);
  const double cosine = glm::dot(from, to);
  if (sine < kTinySine) return cosine > 0.0 ? vector : vector - 2.0 * glm::dot(from, vector) * from;
  return glm::angleAxis(std::atan2(sine, cosine), axis / sine) * vector;
}

class ShapeConstraintsReference final : public ReferenceStrands {
 public:
  explicit ShapeConstraintsReference(const SolverParameters& parameters)
      : ReferenceStrands(read_strand_parameters(parameters)), model_(read_shape_constraints(parameters)) {}

 private:
  /// World velocity of a point that turns and moves with the head: in this substep and in the one before.
  glm::dvec3 rigid_mps(const glm::dvec3& point_m) const {
    return head_velocity_mps() + (carry() * point_m - point_m) / h_s();
  }
  glm::dvec3 rigid_before_mps(const ReferenceStrand& strand, const glm::dvec3& point_m) const {
    return root_before_mps(strand) + previous_turn_mps(point_m - strand.old_m[0]);
  }
  glm::dvec3 root_before_mps(const ReferenceStrand& strand) const {
    return was_intact(strand, 0) ? strand.velocity_mps[0] + head_velocity_mps() : rigid_mps(strand.old_m[0]);
  }

  /// 0 below the acceleration that is fast, 1 from twice that on.
  double fast(const ReferenceStrand& strand) const {
    const double change_mps = glm::distance(rigid_mps(strand.old_m[0]), root_before_mps(strand));
    return std::clamp(change_mps / h_s() / model_.fast_mps2 - 1.0, 0.0, 1.0);
  }

  glm::dvec3 predict(const ReferenceStrand& strand, uint32_t i) const override {
    const glm::dvec3& old = strand.old_m[i];
    const double share = model_.shock_share + (1.0 - model_.shock_share) * fast(strand);
    const glm::dvec3 before = rigid_before_mps(strand, old);
    const glm::dvec3 own =
        (strand.velocity_mps[i] + head_velocity_mps() - before) * std::exp(-model_.damping_per_s * h_s());
    const glm::dvec3 change = (rigid_mps(old) - before) + (carry() * own - own);
    const glm::dvec3 start = before + own + share * change - head_velocity_mps();

    // (1 + h a s + h D) u = start + h (g + D air) + h s (target - x) + b, D the tensor of the drag; a and b
    // as in predict() of reference_strands.cpp.
    const glm::dvec3 along = direction_or(old - strand.old_m[i - 1], glm::dvec3(0.0));
    const glm::dmat3 drag =
        parameters().air_drag_per_s *
        (glm::dmat3(1.0) - (1.0 - model_.air_along_share) * glm::outerProduct(along, along));
    const double stiffness = style_stiffness_per_s2(strand, i);
    const glm::dvec3 air = air_velocity_mps(input(), old) - head_velocity_mps();
    const glm::dvec3 impulse = start + h_s() * (uncarried_gravity_mps2(strand, i) + drag * air) +
                               h_s() * stiffness * (strand.target_m[i] - old) + pulled_on_mps(strand, i);
    const glm::dmat3 system =
        (1.0 + h_s() * pull_ahead_s(h_s()) * stiffness) * glm::dmat3(1.0) + h_s() * drag;
    return old + h_s() * shortened(glm::inverse(system) * impulse, parameters().max_speed_mps);
  }

  void solve(ReferenceStrand& strand) const override {
    std::vector<glm::dvec3> multipliers(layout().vertex_count, glm::dvec3(0.0));
    for (uint32_t round = 0; round < model_.shape_iterations; ++round) hold_shape(strand, multipliers);
    for (uint32_t iteration = 0; iteration < model_.length_iterations; ++iteration) {
      for (const uint32_t colour : {1u, 0u}) {
        for (uint32_t i = 1; i < layout().vertex_count; ++i) {
          if (i % 2 == colour) hold_length(strand, i);
        }
      }
    }
    finish(strand, (1.0 - fast(strand)) * model_.stretch_limit);
  }

  double weight(uint32_t i) const { return is_pinned(i) ? 0.0 : 1.0; }

  /// Returns the direction of the groomed segment that ends at vertex i. A segment of no length takes
  /// that of the one before.
  glm::dvec3 groomed(const ReferenceStrand& strand, uint32_t i) const {
    glm::dvec3 direction(0.0, 1.0, 0.0);
    for (uint32_t j = 1; j <= i; ++j)
      direction = direction_or(strand.target_m[j] - strand.target_m[j - 1], direction);
    return direction;
  }

  /// 1 / (k h^2) in masses of one segment.
  double give(const ReferenceStrand& strand) const {
    double free_m = 0.0;
    const uint32_t first = layout().pinned_root_count;
    for (uint32_t i = first; i < layout().vertex_count; ++i) free_m += strand.segment_m[i];
    const double segment_m = free_m / std::max(layout().vertex_count - first, 1u);
    // Curvature = shear force / (k l^2) droops by w L^3 / (3 k l^2), a rod by w L^4 / (8 E I).
    const double force_per_curvature = 8.0 * model_.bend_stiffness_m4ps2 / (3.0 * free_m);
    const double stiffness_per_s2 = force_per_curvature / (segment_m * segment_m * segment_m);
    const double value = 1.0 / (stiffness_per_s2 * h_s() * h_s());
    return std::isfinite(value) ? value : 0.0;
  }

  void hold_shape(ReferenceStrand& strand, std::vector<glm::dvec3>& multipliers) const {
    const double compliance = give(strand);
    glm::dvec3 before = groomed(strand, 1);
    for (uint32_t i = 1; i < layout().vertex_count; ++i) {
      const glm::dvec3 groomed_before = groomed(strand, std::max(i - 1, 1u));
      const glm::dvec3 wanted = strand.segment_m[i] * turned(groomed_before, before, groomed(strand, i));
      const glm::dvec3 error = strand.placed_m[i] - strand.placed_m[i - 1] - wanted;
      const double weights = weight(i - 1) + weight(i);
      if (weights > 0.0) {
        const glm::dvec3 step =
            model_.shape_relaxation * (-error - compliance * multipliers[i]) / (weights + compliance);
        multipliers[i] += step;
        strand.placed_m[i - 1] -= weight(i - 1) * step;
        strand.placed_m[i] += weight(i) * step;
      }
      before = direction_or(strand.placed_m[i] - strand.placed_m[i - 1], before);
    }
  }

  void hold_length(ReferenceStrand& strand, uint32_t i) const {
    const double weights = weight(i - 1) + weight(i);
    if (weights == 0.0) return;
    const glm::dvec3 along = strand.placed_m[i] - strand.placed_m[i - 1];
    const glm::dvec3 error =
        (glm::length(along) - strand.segment_m[i]) * direction_or(along, groomed(strand, i));
    strand.placed_m[i - 1] += weight(i - 1) / weights * error;
    strand.placed_m[i] -= weight(i) / weights * error;
  }

  /// Root to tip: lengths within the limit, out of colliders, within reach of a pinned tail.
  void finish(ReferenceStrand& strand, double limit) const {
    const uint32_t tail = layout().tail_begin();
    const auto within = [limit](double length_m, double rest_m) {
      return std::clamp(length_m, (1.0 - limit) * rest_m, (1.0 + limit) * rest_m);
    };
    for (uint32_t i = layout().pinned_root_count; i < tail; ++i) {
      const glm::dvec3 start = strand.placed_m[i - 1];
      const glm::dvec3 along = strand.placed_m[i] - start;
      ReferenceSegment segment;
      segment.old_m = strand.old_m[i];
      segment.start_m = start;
      segment.length_m = within(glm::length(along), strand.segment_m[i]);
      segment.end_m = start + segment.length_m * direction_or(along, groomed(strand, i));
      segment.end_m = pushed_out({input(), carry(), parameters().collider_friction}, segment);
      if (layout().pinned_tail_count > 0) {
        const glm::dvec3 anchor = strand.target_m[tail];
        double reach_m = 0.0;
        for (uint32_t j = i + 1; j <= tail; ++j) reach_m += strand.segment_m[j];
        const bool is_last = i + 1 == tail;
        const double farthest_m =
            is_last ? within(glm::distance(strand.placed_m[i], anchor), reach_m) : (1.0 + limit) * reach_m;
        if (is_last || glm::distance(segment.end_m, anchor) > farthest_m)
          segment.end_m = turned_onto_sphere(segment, anchor, farthest_m);
      }
      strand.placed_m[i] = segment.end_m;
    }
  }

  glm::dvec3 way_m(const ReferenceStrand& strand, uint32_t i) const override {
    const glm::dvec3 way = strand.placed_m[i] - strand.old_m[i];
    if (is_pinned(i)) return way;
    const glm::dvec3 rigid_way = carry() * strand.old_m[i] - strand.old_m[i];
    const double kept = std::exp(-model_.fast_damping_per_s * fast(strand) * h_s());
    return rigid_way + kept * (way - rigid_way);
  }

  ShapeConstraintsParameters model_;
};

}  // namespace

std::unique_ptr<Solver> make_shape_constraints_reference(const SolverParameters& parameters) {
  return std::make_unique<ShapeConstraintsReference>(parameters);
}

}  // namespace strandcast

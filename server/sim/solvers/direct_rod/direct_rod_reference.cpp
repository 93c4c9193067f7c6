#include <algorithm>
#include <array>
#include <cmath>

#include "server/sim/banded_system.h"
#include "server/sim/reference_contact.h"
#include "server/sim/reference_solver.h"
#include "server/sim/solvers/direct_rod/direct_rod_rest.h"
#include "server/sim/solvers/direct_rod/direct_rod_style.h"

namespace strandcast {
namespace {

constexpr double kTinyRodLength = 1e-10;
constexpr double kFoldedBack = 1e-6;  // 1 + cosine of tangents that face each other

/// Part of a vector at right angles to a unit vector, as a matrix.
glm::dmat3 across(const glm::dvec3& direction) {
  return glm::dmat3(1.0) - glm::outerProduct(direction, direction);
}

// Unknowns per vertex: its displacement and the spin of the edge that ends there, times the edge's length.
constexpr size_t kUnknowns = 4;

using RodSystem = BandedSystem<kUnknowns, 3>;

/// State of one vertex between steps. Differences, so that the moving origin does not enter them.
struct RodVertex {
  glm::dvec3 position_m{0.0};           // relative to the head joint
  glm::dvec3 velocity_mps{0.0};         // world
  glm::dvec3 displacement_m{0.0};       // during the step before, world
  glm::dvec3 velocity_change_mps{0.0};  // during the step before
  // Of the edge that ends here.
  double tension_m2ps2 = 0.0;
  glm::dvec3 axis{1.0, 0.0, 0.0};  // material, at right angles to the edge, world
  double spin_rad = 0.0;           // of the axis about the edge during the step before
};

/// One end of a joint: an edge's direction, and the tangent and axis that its frame carries to the vertex.
struct JointSide {
  glm::dvec3 direction{0.0};
  glm::dvec3 tangent{0.0};
  glm::dvec3 axis{0.0};
  double length_m = 0.0;       // of the edge; 0 = a clamp, which does not give way
  glm::dvec3 turn_radps{0.0};  // of a clamp
};

/// How a side turns with unit changes of its edge (three directions, and the spin times the length).
std::array<glm::dvec3, kUnknowns> turns_of(const JointSide& side) {
  std::array<glm::dvec3, kUnknowns> turns{};
  if (side.length_m <= 0.0) return turns;
  for (int k = 0; k < 3; ++k) {
    glm::dvec3 unit(0.0);
    unit[k] = 1.0;
    turns[static_cast<size_t>(k)] = glm::cross(side.direction, unit) / side.length_m;
  }
  turns[3] = side.direction / side.length_m;
  return turns;
}

struct RodStrand {
  RodRest rest;
  std::vector<RodVertex> vertex;
  double history_step_s = 0.0;  // length of the step before; 0 = starts anew
};

/// Backward differences: h rate = now (x - x_n) - before (x_n - x_(n-1)).
struct Differences {
  double now = 1.0;
  double before = 0.0;
};

Differences differences_for(double h_s, double history_step_s, uint32_t order) {
  if (order < 2 || history_step_s <= 0.0 || h_s > kMaxStepRatio * history_step_s) return {};
  const double ratio = h_s / history_step_s;
  return {(1.0 + 2.0 * ratio) / (1.0 + ratio), ratio * ratio / (1.0 + ratio)};
}

/// Frames without twist along the strand as it is.
void set_untwisted(RodStrand& strand, uint32_t first, const glm::dquat& rotation) {
  const glm::dvec3 clamp = rotation * strand.rest.clamp_direction;
  glm::dvec3 axis = rotation * strand.rest.clamp_axis;
  glm::dvec3 before = clamp;
  for (size_t i = first; i < strand.vertex.size(); ++i) {
    const glm::dvec3 edge = strand.vertex[i].position_m - strand.vertex[i - 1].position_m;
    const double length = glm::length(edge);
    const bool has_direction = strand.rest.segment_m[i] > strand.rest.shortest_m && length > kTinyRodLength;
    const glm::dvec3 direction = has_direction && is_sane(edge) ? edge / length : before;
    const glm::dvec3 straight(0.0, 0.0, 1.0);
    axis = untwisted_axis(axis, before, direction, i == first ? straight : strand.rest.joint_tangent[i]);
    strand.vertex[i].axis = axis;
    before = direction;
  }
}

/// One step of one strand.
class RodMotion {
 public:
  RodMotion(const RodParameters& parameters, const StrandLayout& layout, uint32_t strand_index,
            const ReferenceStep& step, RodStrand& strand)
      : parameters_(stiffened(parameters, strand.rest.stiffening)),
        step_(step),
        strand_(strand),
        n_(layout.vertex_count),
        first_(layout.pinned_root_count),
        tail_(layout.tail_begin()),
        differences_(differences_for(step.h_s, strand.history_step_s, parameters.order)) {
    for (uint32_t i = 0; i < n_; ++i)
      target_.push_back(step.rotation * glm::dvec3(layout.rest[layout.index(i, strand_index)]));
    clamp_direction_ = step.rotation * strand.rest.clamp_direction;
    const glm::dmat3 carry = glm::mat3_cast(step.carry);
    clamp_turn_radps_ =
        glm::dvec3(carry[1][2] - carry[2][1], carry[2][0] - carry[0][2], carry[0][1] - carry[1][0]) /
        (2.0 * step.h_s);
  }

  void run() {
    bool is_sound = std::all_of(strand_.vertex.begin(), strand_.vertex.end(), [](const RodVertex& vertex) {
      return is_sane(vertex.position_m) && is_sane(vertex.velocity_mps);
    });
    if (is_sound) {
      begin();
      for (uint32_t k = 0; k < parameters_.solves && is_sound; ++k) is_sound = solve();
    }
    if (is_sound) {
      finish();
    } else {
      reset();
    }
  }

 private:
  bool is_free(size_t i) const { return i >= first_ && i < tail_; }
  bool has_free_tip() const { return tail_ == n_; }
  double soft(size_t i) const {
    return soft_length_m(strand_.rest.segment_m[i], strand_.rest.mean_segment_m);
  }
  /// Last vertex that the moving part knows of: its tip, or the second of the pinned tail, for its direction.
  uint32_t last() const { return has_free_tip() ? n_ - 1 : std::min(tail_ + 1, n_ - 1); }

  // A vertex faster than the limit starts again from the limit, without a history.
  void begin() {
    x_ = target_;
    for (uint32_t i = 0; i < n_; ++i) {
      RodVertex& vertex = strand_.vertex[i];
      const glm::dvec3 relative = vertex.velocity_mps - step_.head_velocity_mps;
      if (glm::length(relative) > parameters_.max_speed_mps) {
        vertex.velocity_mps = step_.head_velocity_mps + shortened(relative, parameters_.max_speed_mps);
        vertex.displacement_m = strand_.history_step_s * vertex.velocity_mps;
        vertex.velocity_change_mps = glm::dvec3(0.0);
      }
      old_.push_back(vertex.position_m - step_.shift_m);
      if (is_free(i)) x_[i] = predicted(i);
    }
    if (has_free_tip()) restore_lengths();
    spin_rad_.assign(n_, 0.0);
    for (uint32_t i = 0; i < n_; ++i) axis_.push_back(strand_.vertex[i].axis);
    for (uint32_t i = first_; i <= last_free_edge(); ++i)
      axis_[i] = carried_axis(axis_[i], direction_in(old_, i), direction_at(i));
    const double length = strand_.rest.mean_segment_m * (n_ - first_);
    const double rate = differences_.now / step_.h_s;
    penalty_ = kTensionPerCrossing * length * (length + parameters_.tip_length_m) * rate * rate;
  }

  /// Where the vertex gets to when its velocity goes on changing as it did, within reason.
  glm::dvec3 predicted(uint32_t i) const {
    const RodVertex& vertex = strand_.vertex[i];
    const double ratio = differences_.before > 0.0 ? step_.h_s / strand_.history_step_s : 0.0;
    const double most = kMaxTrendPerSegment * strand_.rest.mean_segment_m / step_.h_s;
    const glm::dvec3 velocity = vertex.velocity_mps + shortened(ratio * vertex.velocity_change_mps, most);
    return old_[i] + (step_.h_s * velocity + differences_.before * vertex.displacement_m) / differences_.now;
  }

  /// The last edge with a free end.
  uint32_t last_free_edge() const { return std::min(tail_, n_ - 1); }

  glm::dvec3 direction_at(uint32_t i) const { return direction_in(x_, i); }

  void restore_lengths() {
    const std::vector<glm::dvec3> before = x_;
    for (uint32_t i = first_; i < n_; ++i)
      x_[i] = x_[i - 1] + strand_.rest.segment_m[i] * direction_in(before, i);
  }

  /// Direction of the edge that ends at vertex i: the groomed one where it has none, that of the edge before
  /// where it has no length to speak of.
  glm::dvec3 direction_in(const std::vector<glm::dvec3>& points, uint32_t i) const {
    for (; i >= first_; --i) {
      if (strand_.rest.segment_m[i] <= strand_.rest.shortest_m) continue;
      const glm::dvec3 edge = points[i] - points[i - 1];
      const double length = glm::length(edge);
      return length > kTinyRodLength ? edge / length : glm::normalize(target_[i] - target_[i - 1]);
    }
    return clamp_direction_;
  }

  glm::dvec3 velocity_at(uint32_t i) const {
    return (differences_.now * (x_[i] - old_[i]) - differences_.before * strand_.vertex[i].displacement_m) /
           step_.h_s;
  }

  /// One Newton step for multipliers, positions and spins together; false when the matrix is not positive.
  bool solve() {
    if (tail_ <= first_) return true;
    RodSystem system(last_free_edge() - first_ + 1);
    for (uint32_t i = first_; i < tail_; ++i) add_inertia(system, i);
    for (uint32_t i = first_; i <= last_free_edge(); ++i) {
      add_tension(system, i);
      add_spin_inertia(system, i);
    }
    for (uint32_t i = first_; i <= last(); ++i) add_joint(system, i);
    // A pinned end does not move; the edge before it may spin.
    if (!has_free_tip()) system.add_block(tail_ - first_, tail_ - first_, glm::dmat3(1.0));
    std::vector<glm::dvec3> moved(n_, glm::dvec3(0.0));
    const std::vector<glm::dvec4> solution = system.solve();
    if (solution.empty()) return false;
    for (uint32_t i = first_; i < tail_; ++i) moved[i] = glm::dvec3(solution[i - first_]);
    std::vector<glm::dvec3> direction_before(n_);
    for (uint32_t i = first_; i <= last_free_edge(); ++i) {
      const glm::dvec3 edge = x_[i] - x_[i - 1];
      direction_before[i] = direction_at(i);
      const double excess =
          has_free_tip() ? 0.0 : glm::dot(edge, direction_before[i]) - strand_.rest.segment_m[i];
      const double opening = excess + glm::dot(direction_before[i], moved[i] - moved[i - 1]);
      strand_.vertex[i].tension_m2ps2 += penalty_ / soft(i) * opening;
    }
    for (uint32_t i = first_; i < tail_; ++i) x_[i] += moved[i];
    if (has_free_tip()) restore_lengths();
    for (uint32_t i = first_; i <= last_free_edge(); ++i) {
      const double spin_rad = solution[i - first_].w / soft(i);
      spin_rad_[i] += spin_rad;
      const glm::dvec3 spun = glm::angleAxis(spin_rad, direction_before[i]) * axis_[i];
      axis_[i] = carried_axis(spun, direction_before[i], direction_at(i));
    }
    return std::all_of(x_.begin(), x_.end(), is_sane) && std::all_of(axis_.begin(), axis_.end(), is_sane);
  }

  void add_inertia(RodSystem& system, uint32_t i) const {
    const double h = step_.h_s;
    const double drag = parameters_.air_drag_per_s;
    const double mass = 0.5 * (soft(i) + (i + 1 < n_ ? soft(i + 1) : 2.0 * parameters_.tip_length_m));
    const RodVertex& vertex = strand_.vertex[i];
    const glm::dvec3 velocity = velocity_at(i);
    const glm::dvec3 acceleration = (differences_.now * (velocity - vertex.velocity_mps) -
                                     differences_.before * vertex.velocity_change_mps) /
                                    h;
    const glm::dvec3 air = air_velocity_mps(*step_.input, vertex.position_m);
    system.add_force(i - first_, mass * (limited(step_.input->gravity_mps2, kMaxGravityMps2) +
                                         drag * (air - velocity) - acceleration));
    const double rate = differences_.now / h;
    system.add_block(i - first_, i - first_, glm::dmat3(mass * (rate * rate + drag * rate)));
  }

  /// Of the section; it counts only where nothing else holds the spin.
  void add_spin_inertia(RodSystem& system, uint32_t i) const {
    const double rate = differences_.now / step_.h_s;
    const size_t row = kUnknowns * (i - first_) + 3;
    system.add(row, row, parameters_.spin_inertia_m2 / soft(i) * rate * rate);
  }

  void add_tension(RodSystem& system, uint32_t i) const {
    const glm::dvec3 edge = x_[i] - x_[i - 1];
    const glm::dvec3 t = direction_at(i);
    const double excess = has_free_tip() ? 0.0 : glm::dot(edge, t) - strand_.rest.segment_m[i];
    const double tension = strand_.vertex[i].tension_m2ps2;
    const glm::dvec3 force = (tension + penalty_ / soft(i) * excess) * t;
    const glm::dmat3 stiffness =
        penalty_ / soft(i) * glm::outerProduct(t, t) + std::max(tension, 0.0) / soft(i) * across(t);
    for (const uint32_t a : {i - 1, i}) {
      if (!is_free(a)) continue;
      system.add_force(a - first_, a == i ? -force : force);
      for (const uint32_t c : {i - 1, i}) {
        if (is_free(c)) system.add_block(a - first_, c - first_, a == c ? stiffness : -stiffness);
      }
    }
  }

  /// What the frame of the edge before vertex i carries to the joint before it (`sign` = -1) or behind it.
  JointSide side_of(uint32_t i, const glm::dvec3& rest_tangent, double sign) const {
    JointSide side;
    side.direction = direction_at(i);
    side.tangent = sign * rest_tangent.x * axis_[i] +
                   sign * rest_tangent.y * glm::cross(side.direction, axis_[i]) +
                   rest_tangent.z * side.direction;
    side.axis = carried_axis(axis_[i], side.direction, side.tangent);
    side.length_m = soft(i);
    return side;
  }

  JointSide clamp_of(const glm::dvec3& direction_in_head, const glm::dvec3& axis_in_head) const {
    JointSide side;
    side.direction = side.tangent = step_.rotation * direction_in_head;
    side.axis = step_.rotation * axis_in_head;
    side.turn_radps = clamp_turn_radps_;
    return side;
  }

  /// The joint at vertex i - 1. Its strain is the difference d of the two sides' tangents, with theta /
  /// sin(theta) for the angle, and the angle between their axes.
  void add_joint(RodSystem& system, uint32_t i) const {
    const bool is_clamp = i == first_;
    const bool is_tail_clamp = i > tail_;
    const RodRest& rest = strand_.rest;
    const glm::dvec3 straight(0.0, 0.0, 1.0);
    const JointSide before = is_clamp ? clamp_of(rest.clamp_direction, rest.clamp_axis)
                                      : side_of(i - 1, is_tail_clamp ? straight : rest.joint_tangent[i], 1.0);
    const JointSide after = is_tail_clamp ? clamp_of(rest.tail_direction, rest.tail_axis)
                                          : side_of(i, is_clamp ? straight : rest.joint_tangent[i], -1.0);
    const glm::dvec3 d = after.tangent - before.tangent;
    const double half_sine_squared = std::min(0.25 * glm::dot(d, d), kMaxHalfSineSquared);
    const double half_sine = std::sqrt(half_sine_squared);
    const double angle = 2.0 * std::asin(half_sine);
    const double per_sine = half_sine > 1e-6 ? angle / std::sin(angle) : 1.0;
    const glm::dvec3 carried = carried_axis(before.axis, before.tangent, after.tangent);
    const double twist =
        std::atan2(glm::dot(glm::cross(carried, after.axis), after.tangent), glm::dot(carried, after.axis));

    const double b = parameters_.stiffness_m4ps2;
    const double per_length = 2.0 / (before.length_m + after.length_m);
    const double tension = strand_.vertex[is_tail_clamp ? i - 1 : i].tension_m2ps2;
    const double bending = is_clamp || is_tail_clamp
                               ? clamp_stiffness(b, tension, before.length_m + after.length_m)
                               : b * per_length;
    const glm::dvec4 weight(glm::dvec3(bending * per_sine), parameters_.twist_stiffness_m4ps2 * per_length);
    add_strain(system, i, {before, after}, glm::dvec4(d, twist), weight);
  }

  /// Twist turns about the sum of the tangents over 1 + their cosine.
  static glm::dvec4 strain_of_turn(const JointSide& side, const glm::dvec3& mean, const glm::dvec3& turn) {
    return {glm::cross(turn, side.tangent), glm::dot(turn, mean)};
  }

  void add_strain(RodSystem& system, uint32_t i, const std::array<JointSide, 2>& side,
                  const glm::dvec4& strain, const glm::dvec4& weight) const {
    const double cosine = glm::dot(side[0].tangent, side[1].tangent);
    const glm::dvec3 mean = (side[0].tangent + side[1].tangent) / std::max(1.0 + cosine, kFoldedBack);
    // Change of the strain with the unknowns of the vertices i - 2, i - 1, i.
    std::array<glm::dvec4, 3 * kUnknowns> jacobian{};
    glm::dvec4 rate(0.0);
    for (size_t k = 0; k < 2; ++k) {
      const double sign = k == 0 ? -1.0 : 1.0;
      const std::array<glm::dvec3, kUnknowns> turns = turns_of(side[k]);
      for (size_t c = 0; c < kUnknowns; ++c) {
        const glm::dvec4 change = sign * strain_of_turn(side[k], mean, turns[c]);
        jacobian[kUnknowns * (k + 1) + c] += change;
        if (c < 3) jacobian[kUnknowns * k + c] -= change;
      }
      rate += sign * strain_of_turn(side[k], mean, side[k].turn_radps);
    }
    const auto is_unknown = [&](size_t p) {
      const size_t vertex = i + p / kUnknowns;  // of i - 2, shifted
      const bool is_spin = p % kUnknowns == 3;
      return vertex >= first_ + 2 && vertex < (is_spin ? last_free_edge() + 1 : tail_) + 2;
    };
    for (size_t p = 0; p < jacobian.size(); ++p) {
      const size_t shifted = i + p / kUnknowns;
      if (shifted < 2 || shifted - 2 >= n_) continue;
      const auto vertex = static_cast<uint32_t>(shifted - 2);
      const auto c = static_cast<int>(p % kUnknowns);
      rate += jacobian[p] * (c < 3 ? velocity_at(vertex)[c] : soft(vertex) * spin_rate_at(vertex));
    }
    const double damping = parameters_.bending_damping_s;
    const glm::dvec4 stress = weight * (strain + damping * rate);
    const glm::dvec4 stiffness = (1.0 + damping * differences_.now / step_.h_s) * weight;
    for (size_t p = 0; p < jacobian.size(); ++p) {
      if (!is_unknown(p)) continue;
      const size_t row = kUnknowns * size_t{i} + p - kUnknowns * size_t{first_ + 2};
      system.add_right(row, -glm::dot(jacobian[p], stress));
      for (size_t q = 0; q < jacobian.size(); ++q) {
        if (is_unknown(q))
          system.add(row, kUnknowns * size_t{i} + q - kUnknowns * size_t{first_ + 2},
                     glm::dot(jacobian[p], stiffness * jacobian[q]));
      }
    }
  }

  double spin_rate_at(uint32_t i) const {
    return (differences_.now * spin_rad_[i] - differences_.before * strand_.vertex[i].spin_rad) / step_.h_s;
  }

  // What colliders, or a pinned tip, move a vertex by after the solve counts as an impulse: once in the
  // velocity, not in its history, which order 2 would turn into a rebound.
  void finish() {
    const std::vector<glm::dvec3> solved = x_;
    for (uint32_t i = 0; i < n_; ++i) {
      RodVertex& vertex = strand_.vertex[i];
      const glm::dvec3 pinned_velocity = (x_[i] - old_[i]) / step_.h_s;
      const glm::dvec3 solved_velocity = is_free(i) ? velocity_at(i) : pinned_velocity;
      if (is_free(i)) place(i, solved);
      vertex.velocity_change_mps = is_free(i) ? solved_velocity - vertex.velocity_mps : glm::dvec3(0.0);
      vertex.velocity_mps = solved_velocity + (x_[i] - solved[i]) / step_.h_s;
      vertex.displacement_m = x_[i] - old_[i];
      vertex.position_m = x_[i];
      vertex.axis = axis_[i];
      vertex.spin_rad = spin_rad_[i];
    }
    for (uint32_t i = first_; i <= last_free_edge(); ++i) {
      strand_.vertex[i].axis = carried_axis(axis_[i], direction_in(solved, i), direction_at(i));
    }
    strand_.history_step_s = step_.h_s;
  }

  /// Puts vertex i as near to where it was solved as its edge, colliders and a pinned tip allow.
  void place(uint32_t i, const std::vector<glm::dvec3>& solved) {
    const double length = strand_.rest.segment_m[i];
    const glm::dvec3 start = x_[i - 1];
    glm::dvec3 end = solved[i];
    if (start != solved[i - 1] || !has_free_tip()) end = start + length * aimed_direction(i, start, solved);
    end = pushed_out({*step_.input, step_.carry, parameters_.collider_friction},
                     {strand_.vertex[i].position_m, start, end, length, target_[i]});
    if (!has_free_tip()) {
      double reach = 0.0;
      for (uint32_t j = i + 1; j <= tail_; ++j) reach += strand_.rest.segment_m[j];
      if (i + 1 == tail_ || glm::distance(end, target_[tail_]) > reach)
        end = turned_onto_sphere({end, start, end, length}, target_[tail_], reach);
    }
    x_[i] = end;
  }

  glm::dvec3 aimed_direction(uint32_t i, const glm::dvec3& start,
                             const std::vector<glm::dvec3>& solved) const {
    const glm::dvec3 way = solved[i] - start;
    const double distance = glm::length(way);
    return distance > kTinyRodLength ? way / distance : direction_in(solved, i);
  }

  void reset() {
    for (uint32_t i = 0; i < n_; ++i) {
      strand_.vertex[i] = RodVertex{};
      strand_.vertex[i].position_m = target_[i];
      strand_.vertex[i].velocity_mps = step_.head_velocity_mps;
    }
    set_untwisted(strand_, first_, step_.rotation);
    strand_.history_step_s = 0.0;
  }

  const RodParameters parameters_;  // of this strand
  const ReferenceStep& step_;
  RodStrand& strand_;
  uint32_t n_;
  uint32_t first_;
  uint32_t tail_;
  Differences differences_;
  std::vector<glm::dvec3> target_;
  std::vector<glm::dvec3> old_;   // position before the step, relative to where the head joint is now
  std::vector<glm::dvec3> x_;     // of the step in progress
  std::vector<glm::dvec3> axis_;  // of the edges
  std::vector<double> spin_rad_;  // in this step
  glm::dvec3 clamp_direction_{0.0};
  glm::dvec3 clamp_turn_radps_{0.0};
  double penalty_ = 0.0;
};

class DirectRodReference final : public ReferenceSolver {
 public:
  explicit DirectRodReference(const SolverParameters& parameters)
      : ReferenceSolver(kMaxReferenceVertexCount), parameters_(read_rod_parameters(parameters)) {}

 private:
  void on_load() override {
    groom_gravity_in_head_mps2_ = glm::dvec3(0.0);
    strands_.assign(layout().strand_count, {});
    for (RodStrand& strand : strands_) strand.vertex.assign(layout().vertex_count, {});
    set_rest();
  }

  void on_step(const ReferenceStep& step) override {
    const glm::dvec3 groom_gravity = limited(step.input->groom_gravity_in_head_mps2, kMaxGravityMps2);
    if (parameters_.sag_free <= 0.0 || groom_gravity == groom_gravity_in_head_mps2_) return;
    groom_gravity_in_head_mps2_ = groom_gravity;
    set_rest();
  }

  void step_strand(const ReferenceStep& step, uint32_t strand_index, std::span<glm::dvec3> position_m,
                   std::span<glm::dvec3> velocity_mps) override {
    RodStrand& strand = strands_[strand_index];
    for (uint32_t i = 0; i < layout().vertex_count; ++i) {
      strand.vertex[i].position_m = position_m[i];
      strand.vertex[i].velocity_mps = velocity_mps[i];
    }
    RodMotion(parameters_, layout(), strand_index, step, strand).run();
    for (uint32_t i = 0; i < layout().vertex_count; ++i) {
      position_m[i] = strand.vertex[i].position_m;
      velocity_mps[i] = strand.vertex[i].velocity_mps;
    }
  }

  void forget(uint32_t strand_index) override {
    RodStrand& strand = strands_[strand_index];
    strand.history_step_s = 0.0;
    for (uint32_t i = 0; i < layout().vertex_count; ++i) {
      strand.vertex[i] = RodVertex{};
      strand.vertex[i].position_m = position_m(strand_index)[i];
    }
    set_untwisted(strand, layout().pinned_root_count, head().world_from_head_rotation);
  }

  // The history is of the way that the strand really went; velocity changes are without impulses.
  void go_along(uint32_t strand_index, std::span<const glm::dvec3> before_m) override {
    const std::span<const glm::dvec3> now_m = position_m(strand_index);
    for (uint32_t i = layout().pinned_root_count; i < layout().vertex_count; ++i) {
      RodVertex& vertex = strands_[strand_index].vertex[i];
      vertex.displacement_m += now_m[i] - before_m[i];
      const glm::dvec3 from = before_m[i] - before_m[i - 1];
      const glm::dvec3 to = now_m[i] - now_m[i - 1];
      if (std::min(glm::length(from), glm::length(to)) > kTinyRodLength)
        vertex.axis = carried_axis(vertex.axis, glm::normalize(from), glm::normalize(to));
    }
  }

  void turn_memory(const glm::dquat& turn) override {
    for (RodStrand& strand : strands_) {
      for (RodVertex& vertex : strand.vertex) {
        vertex.displacement_m = turn * vertex.displacement_m;
        vertex.velocity_change_mps = turn * vertex.velocity_change_mps;
        vertex.axis = turn * vertex.axis;
      }
    }
  }

  uint64_t model_bytes() const override { return layout().size() * sizeof(RodVertex); }

  /// Sets the rest shape. Strands that have not moved yet start with its tensions and frames.
  void set_rest() {
    const auto fit = fit_rod_style(layout(), parameters_, groom_gravity_in_head_mps2_);
    for (uint32_t s = 0; s < layout().strand_count; ++s) {
      RodStrand& strand = strands_[s];
      const RodShape shape = make_rod_shape(layout(), s, parameters_, groom_gravity_in_head_mps2_);
      strand.rest = make_rod_rest(shape, parameters_, static_cast<double>(fit->stiffening[s]));
      for (uint32_t i = 0; i < layout().vertex_count && is_at_rest(); ++i) {
        strand.vertex[i].tension_m2ps2 = strand.rest.tension_m2ps2[i];
        strand.vertex[i].axis = head().world_from_head_rotation * strand.rest.axis[i];
      }
    }
  }

  RodParameters parameters_;
  std::vector<RodStrand> strands_;
  glm::dvec3 groom_gravity_in_head_mps2_{0.0};  // under which the rest shape was found
};

}  // namespace

std::unique_ptr<Solver> make_direct_rod_reference(const SolverParameters& parameters) {
  return std::make_unique<DirectRodReference>(parameters);
}

}  // namespace strandcast

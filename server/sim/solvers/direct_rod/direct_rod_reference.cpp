#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/check.h"
#include "server/sim/reference_contact.h"
#include "server/sim/solvers/direct_rod/direct_rod_rest.h"

namespace strandcast {
namespace {

constexpr double kTinyLength = 1e-10;
constexpr double kBrokenM = 1e12;

bool is_sane(const glm::dvec3& value) {
  return glm::dot(value, value) < kBrokenM * kBrokenM;
}

/// Part of a vector at right angles to a unit vector, as a matrix.
glm::dmat3 across(const glm::dvec3& direction) {
  return glm::dmat3(1.0) - glm::outerProduct(direction, direction);
}

/// Symmetric positive matrix of 3 x 3 blocks up to two off the diagonal, solved by scalar Cholesky.
class BandedSystem {
 public:
  explicit BandedSystem(size_t vertex_count)
      : band_(3 * vertex_count * kWidth, 0.0), right_side_(3 * vertex_count, 0.0) {}
  void add_block(size_t i, size_t j, const glm::dmat3& block) {
    for (size_t r = 0; r < 3; ++r) {
      for (size_t c = 0; c < 3; ++c) {
        if (3 * j + c <= 3 * i + r)
          at(3 * i + r, 3 * j + c) += block[static_cast<int>(c)][static_cast<int>(r)];
      }
    }
  }
  void add_force(size_t i, const glm::dvec3& force) {
    for (size_t c = 0; c < 3; ++c) right_side_[3 * i + c] += force[static_cast<int>(c)];
  }
  /// The solution, or nothing when a pivot is not positive.
  std::vector<glm::dvec3> solve() {
    const size_t n = right_side_.size();
    for (size_t i = 0; i < n; ++i) {
      const size_t begin = i < kWidth ? 0 : i - kWidth + 1;
      for (size_t j = begin; j <= i; ++j) {
        double sum = at(i, j);
        for (size_t k = std::max(begin, j < kWidth ? 0 : j - kWidth + 1); k < j; ++k)
          sum -= at(i, k) * at(j, k);
        if (i == j && !(sum > 0.0)) return {};
        at(i, j) = i == j ? std::sqrt(sum) : sum / at(j, j);
      }
      for (size_t k = begin; k < i; ++k) right_side_[i] -= at(i, k) * right_side_[k];
      right_side_[i] /= at(i, i);
    }
    for (size_t i = n; i-- > 0;) {
      for (size_t k = i + 1; k < std::min(n, i + kWidth); ++k) right_side_[i] -= at(k, i) * right_side_[k];
      right_side_[i] /= at(i, i);
    }
    std::vector<glm::dvec3> solution(n / 3);
    for (size_t i = 0; i < n; ++i) solution[i / 3][static_cast<int>(i % 3)] = right_side_[i];
    return solution;
  }

 private:
  static constexpr size_t kWidth = 9;  // scalars of three blocks
  double& at(size_t row, size_t column) { return band_[row * kWidth + (row - column)]; }

  std::vector<double> band_;  // lower triangle, (3 vertex_count x kWidth)
  std::vector<double> right_side_;
};

/// State of one vertex between steps. Differences, so that the moving origin does not enter them.
struct RodVertex {
  glm::dvec3 position_m{0.0};           // relative to the head joint
  glm::dvec3 velocity_mps{0.0};         // world
  glm::dvec3 displacement_m{0.0};       // during the step before, world
  glm::dvec3 velocity_change_mps{0.0};  // during the step before
  double tension_m2ps2 = 0.0;           // of the edge that ends here
};

struct RodStrand {
  RodRest rest;
  std::vector<RodVertex> vertex;
  double history_step_s = 0.0;  // length of the step before; 0 = starts anew
};

/// What one step of one strand works with.
struct RodStep {
  const StepInput* input = nullptr;
  double h_s = 0.0;
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};
  glm::dquat carry{1.0, 0.0, 0.0, 0.0};
  glm::dvec3 shift_m{0.0};
  glm::dvec3 head_velocity_mps{0.0};
  glm::dvec3 gravity_mps2{0.0};
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

/// One step of one strand.
class RodMotion {
 public:
  RodMotion(const RodParameters& parameters, const StrandLayout& layout, uint32_t strand_index,
            const RodStep& step, RodStrand& strand)
      : parameters_(parameters),
        step_(step),
        strand_(strand),
        n_(layout.vertex_count),
        first_(layout.pinned_root_count),
        tail_(layout.tail_begin()),
        differences_(differences_for(step.h_s, strand.history_step_s, parameters.order)) {
    for (uint32_t i = 0; i < n_; ++i)
      target_.push_back(step.rotation * glm::dvec3(layout.rest[layout.index(i, strand_index)]));
    clamp_direction_ = step.rotation * strand.rest.clamp_direction;
    frame_axis_ = step.rotation * strand.rest.frame_axis;
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
    const double rate = strand_.rest.mean_segment_m * (n_ - first_) * differences_.now / step_.h_s;
    penalty_ = kTensionPerCrossing * rate * rate;
  }

  /// Where the vertex gets to when its velocity goes on changing as it did, within reason.
  glm::dvec3 predicted(uint32_t i) const {
    const RodVertex& vertex = strand_.vertex[i];
    const double ratio = differences_.before > 0.0 ? step_.h_s / strand_.history_step_s : 0.0;
    const double most = kMaxTrendPerSegment * strand_.rest.mean_segment_m / step_.h_s;
    const glm::dvec3 velocity = vertex.velocity_mps + shortened(ratio * vertex.velocity_change_mps, most);
    return old_[i] + (step_.h_s * velocity + differences_.before * vertex.displacement_m) / differences_.now;
  }

  void restore_lengths() {
    const std::vector<glm::dvec3> before = x_;
    for (uint32_t i = first_; i < n_; ++i)
      x_[i] = x_[i - 1] + strand_.rest.segment_m[i] * direction_of(i, before[i] - before[i - 1]);
  }

  /// Direction of the edge that ends at vertex i; the groomed one where it has none.
  glm::dvec3 direction_of(uint32_t i, const glm::dvec3& edge) const {
    const double length = glm::length(edge);
    if (length > kTinyLength) return edge / length;
    const glm::dvec3 groomed = target_[i] - target_[i - 1];
    const double groomed_length = glm::length(groomed);
    return groomed_length > kTinyLength ? groomed / groomed_length : clamp_direction_;
  }

  glm::dvec3 velocity_at(uint32_t i) const {
    return (differences_.now * (x_[i] - old_[i]) - differences_.before * strand_.vertex[i].displacement_m) /
           step_.h_s;
  }

  /// One Newton step for the multipliers and positions together; false when the matrix is not positive.
  bool solve() {
    if (tail_ <= first_) return true;
    BandedSystem system(tail_ - first_);
    for (uint32_t i = first_; i < tail_; ++i) add_inertia(system, i);
    for (uint32_t i = first_; i <= std::min(tail_, n_ - 1); ++i) add_tension(system, i);
    glm::dvec3 axis = frame_axis_;
    glm::dvec3 before = clamp_direction_;
    for (uint32_t i = first_; i <= last(); ++i) {
      const glm::dvec3 direction = direction_of(i, x_[i] - x_[i - 1]);
      const glm::dvec3& c = strand_.rest.rest_direction[i];
      const glm::dvec3 rest = c.x * axis + c.y * glm::cross(before, axis) + c.z * before;
      add_bending(system, i, before, direction, rest);
      axis = carried_axis(axis, before, direction);
      before = direction;
    }
    std::vector<glm::dvec3> moved(n_, glm::dvec3(0.0));
    const std::vector<glm::dvec3> solution = system.solve();
    if (solution.empty()) return false;
    for (uint32_t i = first_; i < tail_; ++i) moved[i] = solution[i - first_];
    for (uint32_t i = first_; i <= std::min(tail_, n_ - 1); ++i) {
      const glm::dvec3 edge = x_[i] - x_[i - 1];
      const double excess = has_free_tip() ? 0.0 : glm::length(edge) - strand_.rest.segment_m[i];
      const double opening = excess + glm::dot(direction_of(i, edge), moved[i] - moved[i - 1]);
      strand_.vertex[i].tension_m2ps2 += penalty_ / soft(i) * opening;
    }
    for (uint32_t i = first_; i < tail_; ++i) x_[i] += moved[i];
    if (has_free_tip()) restore_lengths();
    return std::all_of(x_.begin(), x_.end(), is_sane);
  }

  void add_inertia(BandedSystem& system, uint32_t i) const {
    const double h = step_.h_s;
    const double drag = parameters_.air_drag_per_s;
    const double mass = 0.5 * (soft(i) + (i + 1 < n_ ? soft(i + 1) : 0.0));
    const RodVertex& vertex = strand_.vertex[i];
    const glm::dvec3 velocity = velocity_at(i);
    const glm::dvec3 acceleration = (differences_.now * (velocity - vertex.velocity_mps) -
                                     differences_.before * vertex.velocity_change_mps) /
                                    h;
    const glm::dvec3 air = air_velocity_mps(*step_.input, vertex.position_m);
    system.add_force(i - first_, mass * (step_.gravity_mps2 + drag * (air - velocity) - acceleration));
    const double rate = differences_.now / h;
    system.add_block(i - first_, i - first_, glm::dmat3(mass * (rate * rate + drag * rate)));
  }

  void add_tension(BandedSystem& system, uint32_t i) const {
    const glm::dvec3 edge = x_[i] - x_[i - 1];
    const glm::dvec3 t = direction_of(i, edge);
    const double excess = has_free_tip() ? 0.0 : glm::length(edge) - strand_.rest.segment_m[i];
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

  /// The joint at vertex i - 1: `before` and `after` are the directions of the edges there, `rest` where
  /// `after` would be without a moment. Its strain is d = after - rest, with theta / sin(theta) for the
  /// angle.
  void add_bending(BandedSystem& system, uint32_t i, const glm::dvec3& before, const glm::dvec3& after,
                   const glm::dvec3& rest) const {
    const bool is_clamp = i == first_;
    const bool is_tail_clamp = i > tail_;
    const glm::dvec3 d = after - rest;
    const double half_sine_squared = std::min(0.25 * glm::dot(d, d), kMaxHalfSineSquared);
    const double half_sine = std::sqrt(half_sine_squared);
    const double angle = 2.0 * std::asin(half_sine);
    const double per_sine = half_sine > 1e-6 ? angle / std::sin(angle) : 1.0;

    // d changes by -A with the edge before (the rest direction turns with it) and by C with the edge after.
    glm::dmat3 with_before(0.0);
    glm::dmat3 with_after(0.0);
    glm::dvec3 clamp_rate(0.0);
    if (is_clamp) {
      clamp_rate = (rest - glm::conjugate(step_.carry) * rest) / step_.h_s;
    } else {
      with_before = (glm::dot(before, rest) * glm::dmat3(1.0) - glm::outerProduct(before, rest)) *
                    across(before) / soft(i - 1);
    }
    if (!is_tail_clamp) with_after = across(after) / soft(i);
    const glm::dmat3 jacobian[3] = {with_before, -with_before - with_after, with_after};

    const double b = parameters_.stiffness_m4ps2;
    double weight = per_sine;
    if (is_clamp) {
      weight *= clamp_stiffness(b, strand_.vertex[i].tension_m2ps2, soft(i));
    } else if (is_tail_clamp) {
      weight *= clamp_stiffness(b, strand_.vertex[i - 1].tension_m2ps2, soft(i - 1));
    } else {
      weight *= 2.0 * b / (soft(i - 1) + soft(i));
    }
    glm::dvec3 rate = -clamp_rate;
    for (uint32_t p = is_clamp ? 1 : 0; p < 3; ++p) rate += jacobian[p] * velocity_at(i - 2 + p);
    const double damping = parameters_.bending_damping_s;
    const glm::dvec3 stress = weight * (d + damping * rate);
    const double stiffness = weight * (1.0 + damping * differences_.now / step_.h_s);
    for (uint32_t p = is_clamp ? 1 : 0; p < 3; ++p) {
      const uint32_t row = i - 2 + p;
      if (!is_free(row)) continue;
      system.add_force(row - first_, -(glm::transpose(jacobian[p]) * stress));
      for (uint32_t q = is_clamp ? 1 : 0; q < 3; ++q) {
        const uint32_t column = i - 2 + q;
        if (!is_free(column)) continue;
        system.add_block(row - first_, column - first_,
                         stiffness * (glm::transpose(jacobian[p]) * jacobian[q]));
      }
    }
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
    }
    strand_.history_step_s = step_.h_s;
  }

  /// Puts vertex i as near to where it was solved as its edge, colliders and a pinned tip allow.
  void place(uint32_t i, const std::vector<glm::dvec3>& solved) {
    const double length = strand_.rest.segment_m[i];
    const glm::dvec3 start = x_[i - 1];
    glm::dvec3 end = solved[i];
    if (start != solved[i - 1] || !has_free_tip()) end = start + length * direction_of(i, solved[i] - start);
    end = pushed_out(*step_.input, step_.carry, parameters_.collider_friction,
                     {strand_.vertex[i].position_m, start, end, length});
    if (!has_free_tip()) {
      double reach = 0.0;
      for (uint32_t j = i + 1; j <= tail_; ++j) reach += strand_.rest.segment_m[j];
      if (i + 1 == tail_ || glm::distance(end, target_[tail_]) > reach)
        end = turned_onto_sphere({end, start, end, length}, target_[tail_], reach);
    }
    x_[i] = end;
  }

  void reset() {
    for (uint32_t i = 0; i < n_; ++i) {
      strand_.vertex[i] = RodVertex{};
      strand_.vertex[i].position_m = target_[i];
      strand_.vertex[i].velocity_mps = step_.head_velocity_mps;
    }
    strand_.history_step_s = 0.0;
  }

  const RodParameters& parameters_;
  const RodStep& step_;
  RodStrand& strand_;
  uint32_t n_;
  uint32_t first_;
  uint32_t tail_;
  Differences differences_;
  std::vector<glm::dvec3> target_;
  std::vector<glm::dvec3> old_;  // position before the step, relative to where the head joint is now
  std::vector<glm::dvec3> x_;    // of the step in progress
  glm::dvec3 clamp_direction_{0.0};
  glm::dvec3 frame_axis_{0.0};
  double penalty_ = 0.0;
};

class DirectRodReference final : public Solver {
 public:
  explicit DirectRodReference(const SolverParameters& parameters)
      : parameters_(read_rod_parameters(parameters)) {}

  Status load(const Groom& groom, const glm::dquat& world_from_head) override {
    ASSIGN_OR_RETURN(layout_, make_strand_layout(groom, kMaxReferenceVertexCount));
    previous_rotation_ = limited_rotation(world_from_head);
    const glm::dvec3 gravity_in_head =
        glm::conjugate(previous_rotation_) * glm::dvec3(0.0, -kStandardGravityMps2, 0.0);
    strands_.assign(layout_.strand_count, {});
    for (uint32_t s = 0; s < layout_.strand_count; ++s) {
      RodStrand& strand = strands_[s];
      strand.rest = make_rod_rest(layout_, s, parameters_, gravity_in_head);
      strand.vertex.assign(layout_.vertex_count, {});
      for (uint32_t i = 0; i < layout_.vertex_count; ++i) {
        strand.vertex[i].position_m = previous_rotation_ * glm::dvec3(layout_.rest[layout_.index(i, s)]);
        strand.vertex[i].tension_m2ps2 = strand.rest.tension_m2ps2[i];
      }
    }
    return {};
  }

  void substep(const StepInput& input) override {
    RodStep step;
    step.input = &input;
    step.h_s = limited_substep_s(input);
    step.rotation = limited_rotation(input.world_from_head);
    step.carry = step.rotation * glm::conjugate(previous_rotation_);
    step.shift_m = limited(input.head_shift_m, kMaxHeadShiftM);
    step.head_velocity_mps = step.shift_m / step.h_s;
    step.gravity_mps2 = limited(input.gravity_mps2, kMaxGravityMps2);
    for (uint32_t s = 0; s < layout_.strand_count; ++s)
      RodMotion(parameters_, layout_, s, step, strands_[s]).run();
    previous_rotation_ = step.rotation;
  }

  void read(SolverState& state) override {
    state.position_m.resize(layout_.size());
    state.velocity_mps.resize(layout_.size());
    for (uint32_t s = 0; s < layout_.strand_count; ++s) {
      for (uint32_t i = 0; i < layout_.vertex_count; ++i) {
        state.position_m[layout_.index(i, s)] = glm::vec3(strands_[s].vertex[i].position_m);
        state.velocity_mps[layout_.index(i, s)] = glm::vec3(strands_[s].vertex[i].velocity_mps);
      }
    }
  }

  // A strand that is written as it was read goes on as if nothing had happened.
  void write(const SolverState& state) override {
    CHECK(state.position_m.size() == layout_.size() && state.velocity_mps.size() == layout_.size());
    for (uint32_t s = 0; s < layout_.strand_count; ++s) {
      RodStrand& strand = strands_[s];
      bool is_changed = false;
      for (uint32_t i = 0; i < layout_.vertex_count; ++i) {
        is_changed = is_changed ||
                     state.position_m[layout_.index(i, s)] != glm::vec3(strand.vertex[i].position_m) ||
                     state.velocity_mps[layout_.index(i, s)] != glm::vec3(strand.vertex[i].velocity_mps);
      }
      if (!is_changed) continue;
      strand.history_step_s = 0.0;
      for (uint32_t i = 0; i < layout_.vertex_count; ++i) {
        strand.vertex[i] = RodVertex{};
        strand.vertex[i].position_m = glm::dvec3(state.position_m[layout_.index(i, s)]);
        strand.vertex[i].velocity_mps = glm::dvec3(state.velocity_mps[layout_.index(i, s)]);
      }
    }
  }

  uint64_t memory_bytes() const override { return layout_.size() * sizeof(RodVertex); }

 private:
  RodParameters parameters_;
  StrandLayout layout_;
  std::vector<RodStrand> strands_;
  glm::dquat previous_rotation_{1.0, 0.0, 0.0, 0.0};
};

}  // namespace

std::unique_ptr<Solver> make_direct_rod_reference(const SolverParameters& parameters) {
  return std::make_unique<DirectRodReference>(parameters);
}

}  // namespace strandcast

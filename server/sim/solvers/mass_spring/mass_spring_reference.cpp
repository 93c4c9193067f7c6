#include <algorithm>
#include <array>
#include <cmath>

#include "server/sim/banded_system.h"
#include "server/sim/directions.h"
#include "server/sim/reference_contact.h"
#include "server/sim/reference_solver.h"
#include "server/sim/solvers/mass_spring/mass_spring.h"
#include "server/sim/strand_parameters.h"

namespace strandcast {
namespace {

constexpr double kShortestSpringM = 1e-6;
constexpr double kNearlyReversed = 0.02;  // 1 + cos of 164 degrees

/// A linear form in the positions of consecutive vertices: value = constant part, jacobian[k] on vertex first
/// + k.
struct Strain {
  uint32_t first = 0;
  uint32_t count = 0;
  glm::dvec3 value{0.0};
  std::array<glm::dmat3, 4> jacobian{};
};

/// Altitude springs reach three vertices.
using SpringSystem = BandedSystem<3, 4>;

/// One substep of one strand; positions relative to the head joint, velocities relative to its movement.
class SpringMotion {
 public:
  SpringMotion(const MassSpringParameters& springs, const StrandParameters& shared,
               const StrandLayout& layout, uint32_t strand_index, const ReferenceStep& step)
      : springs_(springs),
        shared_(shared),
        step_(step),
        n_(layout.vertex_count),
        first_(layout.pinned_root_count),
        tail_(layout.tail_begin()) {
    for (uint32_t i = 0; i < n_; ++i) {
      const glm::dvec4 rest(layout.rest[layout.index(i, strand_index)]);
      target_.push_back(step.rotation * glm::dvec3(rest));
      segment_.push_back(rest.w);
      soft_.push_back(std::max(rest.w, springs.shortest_segment_m));
      const double from_tip = 1.0 - static_cast<double>(layout.arc[layout.index(i, strand_index)]);
      pull_.push_back(shared.style_stiffness_per_s2 *
                      (shared.style_tip_share + (1.0 - shared.style_tip_share) * from_tip * from_tip));
    }
  }

  /// Positions and world velocities before the substep are replaced by those after it.
  void run(std::span<glm::dvec3> position, std::span<glm::dvec3> velocity) {
    begin(position, velocity);
    const bool is_implicit = springs_.integrator == SpringIntegrator::BackwardEuler;
    bool is_sound = true;
    if (is_implicit) {
      for (uint32_t solve = 0; solve < springs_.solves && is_sound; ++solve) is_sound = newton_step(solve);
      for (uint32_t i = first_; i < tail_; ++i) end_velocity_[i] = (x_[i] - old_[i]) / step_.h_s;
    } else {
      explicit_step();
    }
    std::ranges::copy(finish(is_sound), position.begin());
    for (uint32_t i = 0; i < n_; ++i) {
      const glm::dvec3 relative = is_free(i) ? end_velocity_[i] + (position[i] - x_[i]) / step_.h_s
                                             : (target_[i] - old_[i]) / step_.h_s;
      velocity[i] = step_.head_velocity_mps;
      if (is_sound && is_sane(relative)) velocity[i] += shortened(relative, shared_.max_speed_mps);
    }
  }

 private:
  bool is_free(uint32_t i) const { return i >= first_ && i < tail_; }
  bool has_free_tip() const { return tail_ == n_; }
  /// Last vertex that the springs of the free ones reach.
  uint32_t last() const { return has_free_tip() ? n_ - 1 : std::min(tail_ + 1, n_ - 1); }
  double hold(uint32_t i) const {
    return 1.0 + step_.h_s * (shared_.air_drag_per_s + pull_ahead_s(step_.h_s) * pull_[i]);
  }
  /// Mass over the mass per length.
  double mass(uint32_t i) const { return 0.5 * (soft_[i] + (i + 1 < n_ ? soft_[i + 1] : 0.0)); }
  double capped(double stiffness, double inertia) const {
    return std::min(stiffness, kMaxImplicitRatio * inertia);
  }

  void begin(std::span<const glm::dvec3> position, std::span<const glm::dvec3> velocity) {
    for (uint32_t i = 0; i < n_; ++i) {
      const bool is_intact = is_sane(position[i]) && is_sane(velocity[i]);
      old_.push_back(is_intact ? position[i] : target_[i]);
      velocity_.push_back(is_intact ? velocity[i] - step_.head_velocity_mps : glm::dvec3(0.0));
      if (!is_free(i)) velocity_[i] = (target_[i] - old_[i]) / step_.h_s;
      predicted_.push_back(is_free(i) ? predicted(i) : target_[i]);
    }
    end_velocity_ = velocity_;
    x_ = predicted_;
  }

  // As predict() of reference_strands.cpp: implicit in drag and pull, forward for the rest.
  glm::dvec3 predicted(uint32_t i) const {
    const double h = step_.h_s;
    const double carried = shared_.sag_free * std::min(1.0, pull_[i] / kSupportStiffnessPerS2);
    const glm::dvec3 groom_gravity = limited(step_.input->groom_gravity_in_head_mps2, kMaxGravityMps2);
    const glm::dvec3 support = -carried * (step_.rotation * groom_gravity);
    const glm::dvec3 gravity = limited(step_.input->gravity_mps2, kMaxGravityMps2) + support;
    const glm::dvec3 held = pull_[i] * target_[i] + support;
    const glm::dvec3 air = air_velocity_mps(*step_.input, old_[i]) - step_.head_velocity_mps;
    const glm::dvec3 impulse =
        velocity_[i] + h * (gravity + shared_.air_drag_per_s * air + pull_[i] * (target_[i] - old_[i])) +
        (pull_ahead_s(h) - h) * (held - glm::conjugate(step_.carry) * held);
    return old_[i] + h * shortened(impulse / hold(i), shared_.max_speed_mps);
  }

  /// Directions of all edges, and rest directions: each turned with the edge before from its groomed
  /// direction.
  void measure(const std::vector<glm::dvec3>& x) {
    glm::dvec3 groomed = step_.rotation * glm::dvec3(0.0, 1.0, 0.0);
    if (first_ >= 2) groomed = direction_or(target_[first_ - 1] - target_[first_ - 2], groomed);
    direction_.assign(n_, groomed);
    rest_.assign(n_, groomed);
    groomed_.assign(n_, groomed);
    glm::dquat turn(1.0, 0.0, 0.0, 0.0);
    for (uint32_t i = first_; i <= last(); ++i) {
      groomed = direction_or(target_[i] - target_[i - 1], groomed);
      groomed_[i] = groomed;
      rest_[i] = turn * groomed;
      direction_[i] = direction_or(x[i] - x[i - 1], rest_[i]);
      turn = smallest_rotation(groomed, direction_[i]);
    }
  }

  glm::dvec3 relative_edge(const std::vector<glm::dvec3>& x, uint32_t i) const {
    return (x[i] - x[i - 1]) / soft_[i] + (1.0 - segment_[i] / soft_[i]) * direction_[i];
  }

  /// The joint before edge i.
  Strain bend_of(const std::vector<glm::dvec3>& x, uint32_t i) const {
    const glm::dmat3 after = glm::dmat3(1.0 / soft_[i]);
    if (i == first_) return {i, 1, relative_edge(x, i) - rest_[i], {after}};
    // The rest direction u of this edge is R r_i with R the smallest rotation of the edge before from its
    // groomed direction r to its direction t. When t moves by dt, R turns by t x dt - t (k . dt), k = r x t /
    // (1 + r . t) being half the tangent's twist; u changes by that turn, and in length with the edge before.
    const glm::dvec3 t = direction_[i - 1];
    const glm::dvec3 u = rest_[i];
    const glm::dvec3 k =
        glm::cross(groomed_[i - 1], t) / std::max(1.0 + glm::dot(groomed_[i - 1], t), kNearlyReversed);
    const auto change = [&](const glm::dvec3& strain_change) {
      const glm::dvec3 dt = strain_change - t * glm::dot(t, strain_change);
      return u * glm::dot(t, strain_change) + glm::cross(glm::cross(t, dt) - t * glm::dot(k, dt), u);
    };
    const glm::dmat3 turn(change({1.0, 0.0, 0.0}), change({0.0, 1.0, 0.0}), change({0.0, 0.0, 1.0}));
    const glm::dmat3 before = turn / soft_[i - 1];
    return {i - 2, 3, relative_edge(x, i) - turn * relative_edge(x, i - 1), {before, -after - before, after}};
  }

  bool has_altitude(uint32_t i) const {
    return springs_.altitude_mps2 > 0.0 && i >= first_ + (first_ >= 2 ? 1 : 2);
  }

  /// The tetrahedron that ends at vertex i; only the first component counts.
  Strain altitude_of(const std::vector<glm::dvec3>& x, uint32_t i) const {
    // The lengths of edges between pinned vertices count as well.
    const double longest = std::max({soft_[i], soft_[i - 1], soft_[i - 2]});
    const double per_base = 1.0 / (longest * longest);
    const auto volume = [i](const std::vector<glm::dvec3>& p) {
      return glm::dot(p[i - 2] - p[i - 3], glm::cross(p[i - 1] - p[i - 2], p[i] - p[i - 1]));
    };
    const glm::dvec3 a = x[i - 2] - x[i - 3];
    const glm::dvec3 b = x[i - 1] - x[i - 2];
    const glm::dvec3 c = x[i] - x[i - 1];
    const glm::dvec3 by_a = per_base * glm::cross(b, c);
    const glm::dvec3 by_b = per_base * glm::cross(c, a);
    const glm::dvec3 by_c = per_base * glm::cross(a, b);
    Strain strain{i - 3, 4, glm::dvec3(per_base * (volume(x) - volume(target_)), 0.0, 0.0), {}};
    const std::array<glm::dvec3, 4> gradient = {-by_a, by_a - by_b, by_b - by_c, by_c};
    for (size_t k = 0; k < 4; ++k)
      strain.jacobian[k] = glm::outerProduct(glm::dvec3(1.0, 0.0, 0.0), gradient[k]);
    return strain;
  }

  void add_strain(SpringSystem& system, const Strain& strain, double weight) const {
    for (uint32_t a = 0; a < strain.count; ++a) {
      if (!is_free(strain.first + a)) continue;
      const size_t row = strain.first + a - first_;
      const glm::dmat3 transposed = weight * glm::transpose(strain.jacobian[a]);
      system.add_force(row, -(transposed * strain.value));
      for (uint32_t b = 0; b < strain.count; ++b) {
        if (is_free(strain.first + b))
          system.add_block(row, strain.first + b - first_, transposed * strain.jacobian[b]);
      }
    }
  }

  double length_before(uint32_t i) const { return glm::distance(old_[i], old_[i - 1]); }

  /// The motion going on as it is: its directions, each from the vertex placed before, with the lengths that
  /// the springs had. At rest that is the solution.
  void start_iterate() {
    for (uint32_t i = first_; i < tail_; ++i)
      x_[i] = old_[i] + step_.h_s * shortened(velocity_[i], shared_.max_speed_mps);
    if (!has_free_tip()) return;
    measure(x_);
    glm::dquat turn(1.0, 0.0, 0.0, 0.0);
    glm::dvec3 groomed = direction_[0];
    for (uint32_t i = first_; i < n_; ++i) {
      groomed = direction_or(target_[i] - target_[i - 1], groomed);
      const glm::dvec3 rest = turn * groomed;
      const double slack = springs_.stretch_limit * segment_[i];
      const double length =
          std::clamp(length_before(i), std::max(segment_[i] - slack, 0.0), segment_[i] + slack);
      const glm::dvec3 direction = direction_or(x_[i] - x_[i - 1], rest);
      x_[i] = x_[i - 1] + length * direction;
      turn = smallest_rotation(groomed, direction);
    }
  }

  /// False when the matrix is not positive.
  bool newton_step(uint32_t solve) {
    if (tail_ <= first_) return true;
    if (solve == 0) start_iterate();
    measure(x_);
    SpringSystem system(tail_ - first_);
    for (uint32_t i = first_; i < tail_; ++i) {
      system.add_force(i - first_, mass(i) * hold(i) * (predicted_[i] - x_[i]));
      system.add_block(i - first_, i - first_, glm::dmat3(mass(i) * hold(i)));
    }
    const double h = step_.h_s;
    for (uint32_t i = first_; i <= last(); ++i) {
      add_stretch(system, i);
      const double shortest = i == first_ ? soft_[i] : std::min(soft_[i], soft_[i - 1]);
      const double bend = capped(h * h * springs_.bend_m3ps2, std::pow(shortest, 3) / kBendPerStretch);
      add_strain(system, bend_of(x_, i), i == first_ ? 2.0 * bend : bend);
      if (!has_altitude(i)) continue;
      const double shortest_of_three = std::min({soft_[i], soft_[i - 1], soft_[i - 2]});
      add_strain(system, altitude_of(x_, i),
                 capped(h * h * springs_.altitude_mps2, shortest_of_three / kAltitudePerStretch));
    }
    const std::vector<glm::dvec3> moved = system.solve();
    if (moved.empty()) return false;
    for (uint32_t i = first_; i < tail_; ++i) x_[i] += moved[i - first_];
    return std::all_of(x_.begin(), x_.end(), is_sane);
  }

  void add_stretch(SpringSystem& system, uint32_t i) const {
    const double h = step_.h_s;
    const double spring = capped(h * h * springs_.stretch_mps2, soft_[i]);
    const double damper = capped(h * springs_.stretch_damping_mps, soft_[i]);
    const glm::dvec3& t = direction_[i];
    const double length = glm::dot(x_[i] - x_[i - 1], t);
    const glm::dvec3 pull = (spring * (length - segment_[i]) + damper * (length - length_before(i))) * t;
    const double across = spring * std::max(length - segment_[i], 0.0) / std::max(length, kShortestSpringM);
    const glm::dmat3 stiffness =
        (spring + damper) * glm::outerProduct(t, t) + across * (glm::dmat3(1.0) - glm::outerProduct(t, t));
    for (const uint32_t a : {i - 1, i}) {
      if (!is_free(a)) continue;
      system.add_force(a - first_, a == i ? -pull : pull);
      for (const uint32_t b : {i - 1, i}) {
        if (is_free(b)) system.add_block(a - first_, b - first_, a == b ? stiffness : -stiffness);
      }
    }
  }

  void explicit_step() {
    const double h = step_.h_s;
    const double share = springs_.integrator == SpringIntegrator::Verlet ? 0.5 : 0.0;
    std::vector<glm::dvec3> x(n_);
    for (uint32_t i = 0; i < n_; ++i) x[i] = old_[i] + share * h * velocity_[i];
    measure(x);
    std::vector<glm::dvec3> force(n_, glm::dvec3(0.0));
    const auto push = [&](const Strain& strain, double weight) {
      for (uint32_t k = 0; k < strain.count; ++k)
        force[strain.first + k] -= weight * (glm::transpose(strain.jacobian[k]) * strain.value);
    };
    for (uint32_t i = first_; i <= last(); ++i) {
      const glm::dvec3& t = direction_[i];
      const double stretch_m = glm::dot(x[i] - x[i - 1], t) - segment_[i];
      const double opening_mps = glm::dot(velocity_[i] - velocity_[i - 1], t);
      const glm::dvec3 pull =
          (springs_.stretch_mps2 * stretch_m + springs_.stretch_damping_mps * opening_mps) * t;
      force[i] -= pull;
      force[i - 1] += pull;
      push(bend_of(x, i), i == first_ ? 2.0 * springs_.bend_m3ps2 : springs_.bend_m3ps2);
      if (has_altitude(i)) push(altitude_of(x, i), springs_.altitude_mps2);
    }
    for (uint32_t i = first_; i < tail_; ++i) {
      const glm::dvec3 velocity = (predicted_[i] - old_[i]) / h + h * force[i] / (mass(i) * hold(i));
      end_velocity_[i] = shortened(velocity, shared_.max_speed_mps);
      x_[i] = x[i] + (1.0 - share) * h * end_velocity_[i];
    }
  }

  /// Lengths within the limit, outside the colliders.
  std::vector<glm::dvec3> finish(bool is_sound) const {
    std::vector<glm::dvec3> end = target_;
    for (uint32_t i = first_; is_sound && i < tail_; ++i) {
      if (!is_sane(x_[i])) continue;
      const glm::dvec3 edge = x_[i] - end[i - 1];
      double length = glm::length(edge);
      if (has_free_tip()) {
        const double slack = springs_.stretch_limit * segment_[i];
        length = std::clamp(length, std::max(segment_[i] - slack, 0.0), segment_[i] + slack);
      }
      const glm::dvec3 groomed = direction_or(target_[i] - target_[i - 1], glm::dvec3(0.0));
      const glm::dvec3 point = end[i - 1] + length * direction_or(edge, groomed);
      end[i] = pushed_out({*step_.input, step_.carry, shared_.collider_friction},
                          {old_[i], end[i - 1], point, length});
    }
    return end;
  }

  const MassSpringParameters& springs_;
  const StrandParameters& shared_;
  const ReferenceStep& step_;
  uint32_t n_;
  uint32_t first_;
  uint32_t tail_;
  std::vector<glm::dvec3> target_;
  std::vector<double> segment_;
  std::vector<double> soft_;
  std::vector<double> pull_;
  std::vector<glm::dvec3> old_;
  std::vector<glm::dvec3> velocity_;
  std::vector<glm::dvec3> predicted_;
  std::vector<glm::dvec3> x_;             // the iterate, then the solution
  std::vector<glm::dvec3> end_velocity_;  // relative, before limit and colliders
  std::vector<glm::dvec3> direction_;     // of the edge that ends at a vertex
  std::vector<glm::dvec3> groomed_;       // its direction in the groom, turned with the head
  std::vector<glm::dvec3> rest_;          // where that edge would be without a moment
};

class MassSpringReference final : public ReferenceSolver {
 public:
  explicit MassSpringReference(const SolverParameters& parameters)
      : springs_(read_mass_spring(parameters)), shared_(read_strand_parameters(parameters)) {}

 private:
  void step_strand(const ReferenceStep& step, uint32_t strand_index, std::span<glm::dvec3> position_m,
                   std::span<glm::dvec3> velocity_mps) override {
    SpringMotion(springs_, shared_, layout(), strand_index, step).run(position_m, velocity_mps);
  }

  MassSpringParameters springs_;
  StrandParameters shared_;
};

}  // namespace

std::unique_ptr<Solver> make_mass_spring_reference(const SolverParameters& parameters) {
  return std::make_unique<MassSpringReference>(parameters);
}

}  // namespace strandcast

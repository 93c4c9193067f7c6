// The chain in double: frames as quaternions, the matrix of all segments at once, dense.
#include "server/sim/solvers/articulated/articulated.h"

#include <algorithm>
#include <cmath>

#include "server/sim/reference_strands.h"
#include "server/sim/solvers/direct_rod/direct_rod_rest.h"

namespace strandcast {
namespace {

constexpr double kTinyLength = 1e-10;
constexpr double kMinLengthM = 1e-5;
// As in the kernel, which says why.
constexpr uint32_t kHeldSolves = 2;
constexpr double kAnchorMass = 100.0;
constexpr double kSpinShare = 1e-4;
constexpr double kMaxTurnRad = 1.0;
constexpr double kMinOpening = 0.1;

const glm::dvec3 kAxis(1.0, 0.0, 0.0);   // of a frame: across the segment
const glm::dvec3 kAlong(0.0, 0.0, 1.0);  // of a frame: along the segment

/// Smallest rotation from one unit vector to another.
glm::dquat between(const glm::dvec3& from, const glm::dvec3& to) {
  const double cosine = glm::dot(from, to);
  if (cosine < -1.0 + 1e-12) {
    const glm::dvec3 other = std::abs(from.x) < 0.6 ? kAxis : glm::dvec3(0.0, 1.0, 0.0);
    return glm::angleAxis(glm::radians(180.0), glm::normalize(glm::cross(from, other)));
  }
  return glm::normalize(glm::dquat(1.0 + cosine, glm::cross(from, to)));
}

glm::dvec3 direction_or(const glm::dvec3& edge, const glm::dvec3& otherwise) {
  const double length = glm::length(edge);
  return length > kTinyLength ? edge / length : otherwise;
}

/// The frame turned by the smallest rotation to another direction.
glm::dquat carried(const glm::dquat& frame, const glm::dvec3& along) {
  return between(frame * kAlong, along) * frame;
}

glm::dquat spun(const glm::dquat& frame, double angle) {
  return frame * glm::angleAxis(angle, kAlong);
}

/// Rotation vector between two frames, with the sine for the angle.
glm::dvec3 turn_between(const glm::dquat& from, const glm::dquat& to) {
  const glm::dquat turn = to * glm::conjugate(from);
  return 2.0 * turn.w * glm::dvec3(turn.x, turn.y, turn.z);
}

/// A frame that goes with the direction; which one does not matter.
glm::dquat frame_along(const glm::dvec3& along) {
  const glm::dvec3 other = std::abs(along.x) < 0.6 ? kAxis : glm::dvec3(0.0, 1.0, 0.0);
  const glm::dvec3 axis = glm::normalize(glm::cross(along, other));
  return glm::normalize(glm::quat_cast(glm::dmat3(axis, glm::cross(along, axis), along)));
}

glm::dmat3 cross_matrix(const glm::dvec3& v) {
  return {glm::dvec3(0.0, v.z, -v.y), glm::dvec3(-v.z, 0.0, v.x), glm::dvec3(v.y, -v.x, 0.0)};
}

/// Symmetric positive matrix of 3 x 3 blocks, dense, solved by Cholesky's method.
class DenseSystem {
 public:
  explicit DenseSystem(size_t block_count)
      : size_(3 * block_count), matrix_(size_ * size_, 0.0), right_side_(size_, 0.0) {}
  void add_block(size_t i, size_t j, const glm::dmat3& block) {
    for (size_t r = 0; r < 3; ++r)
      for (size_t c = 0; c < 3; ++c)
        at(3 * i + r, 3 * j + c) += block[static_cast<int>(c)][static_cast<int>(r)];
  }
  void add_right(size_t i, const glm::dvec3& value) {
    for (size_t c = 0; c < 3; ++c) right_side_[3 * i + c] += value[static_cast<int>(c)];
  }
  /// Uses the blocks (i, j) with j <= i. Empty when the matrix is not positive.
  std::vector<glm::dvec3> solve() {
    for (size_t i = 0; i < size_; ++i) {
      double* row = &matrix_[i * size_];
      for (size_t j = 0; j <= i; ++j) {
        const double* other = &matrix_[j * size_];
        double sum = row[j];
        for (size_t k = 0; k < j; ++k) sum -= row[k] * other[k];
        if (i == j && !(sum > 0.0)) return {};
        row[j] = i == j ? std::sqrt(sum) : sum / other[j];
      }
      for (size_t k = 0; k < i; ++k) right_side_[i] -= row[k] * right_side_[k];
      right_side_[i] /= row[i];
    }
    for (size_t i = size_; i-- > 0;) {
      right_side_[i] /= at(i, i);
      for (size_t k = 0; k < i; ++k) right_side_[k] -= at(i, k) * right_side_[i];
    }
    std::vector<glm::dvec3> solution(size_ / 3);
    for (size_t i = 0; i < size_; ++i) solution[i / 3][static_cast<int>(i % 3)] = right_side_[i];
    return solution;
  }

 private:
  double& at(size_t row, size_t column) { return matrix_[row * size_ + column]; }

  size_t size_;
  std::vector<double> matrix_;
  std::vector<double> right_side_;
};

/// One segment during one substep.
struct Segment {
  double length_m = 0.0;                     // as it is
  double lever_m = 0.0;                      // as it counts in the matrix
  double mass_m = 0.0;                       // of the vertex at its end, with drag and pull
  glm::dvec3 aim_m{0.0};                     // of that vertex
  glm::dquat rest_turn{1.0, 0.0, 0.0, 0.0};  // rest frame, seen from the frame before
  glm::dquat frame{1.0, 0.0, 0.0, 0.0};      // now
  glm::dvec3 turn{0.0};                      // during the substep
  glm::dvec3 along() const { return frame * kAlong; }
};

struct Chain {
  glm::dvec3 root_m{0.0};
  glm::dquat clamp{1.0, 0.0, 0.0, 0.0};
  glm::dvec3 clamp_turn{0.0};
  std::vector<Segment> segment;
};

struct Joint {
  glm::dvec3 moment{0.0};
  glm::dmat3 stiffness{0.0};
};

class ArticulatedReference final : public ReferenceStrands {
 public:
  ArticulatedReference(const StrandParameters& shared, const ChainParameters& parameters)
      : ReferenceStrands(shared), parameters_(parameters) {}

 private:
  /// The spin of every segment against the frame that is carried along without twist.
  size_t memory_size() const override { return layout().vertex_count; }

  void solve(ReferenceStrand& strand) const override {
    const uint32_t first = layout().pinned_root_count;
    if (layout().tail_begin() <= first) return;
    Chain chain = begin(strand);
    bool is_sound = true;
    const uint32_t solves =
        layout().pinned_tail_count > 0 ? std::max(parameters_.solves, kHeldSolves) : parameters_.solves;
    for (uint32_t k = 0; k < solves && is_sound; ++k) is_sound = turn_segments(chain);
    glm::dquat untwisted = chain.clamp;
    glm::dvec3 missed(0.0);
    double way_m = 0.0;
    if (layout().pinned_tail_count > 0) {
      missed = strand.target_m[layout().tail_begin()] - chain.root_m;
      for (const Segment& segment : chain.segment) {
        missed -= segment.length_m * segment.along();
        way_m += segment.length_m;
      }
      missed /= std::max(way_m, kMinLengthM);
      way_m = 0.0;
    }
    glm::dvec3 solved = chain.root_m;
    for (uint32_t i = first; i < layout().tail_begin(); ++i) {
      const Segment& segment = chain.segment[i - first];
      const glm::dvec3 groomed =
          direction_or(strand.target_m[i] - strand.target_m[i - 1], chain.clamp * kAlong);
      const glm::dvec3 along = is_sound ? segment.along() : groomed;
      untwisted = carried(untwisted, along);
      const glm::dquat spin = glm::conjugate(untwisted) * segment.frame;
      strand.memory[i] = is_sound ? 2.0 * std::atan(spin.z / spin.w) : 0.0;
      solved += segment.length_m * along;
      way_m += segment.length_m;
      strand.predicted_m[i] = solved + way_m * missed;
      place(strand, i);
    }
  }

  glm::dvec3 rest_m(const ReferenceStrand& strand, uint32_t i) const {
    return glm::dvec3(layout().rest[layout().index(i, strand.index)]);
  }

  Chain begin(ReferenceStrand& strand) const {
    const uint32_t first = layout().pinned_root_count;
    const uint32_t last = std::min(layout().tail_begin(), layout().vertex_count - 1);
    const uint32_t clamp_end = std::max(first - 1, 1u);
    const glm::dquat head = rotation();
    const glm::dquat old_head = glm::conjugate(carry()) * head;
    glm::dquat rest = frame_along(
        direction_or(rest_m(strand, clamp_end) - rest_m(strand, clamp_end - 1), glm::dvec3(0.0, 1.0, 0.0)));
    Chain chain;
    chain.root_m = strand.target_m[first - 1];
    chain.clamp = head * rest;
    chain.clamp_turn = turn_between(old_head * rest, chain.clamp);
    glm::dquat old = old_head * rest;
    glm::dquat now = chain.clamp;
    double total = 0.0;
    for (uint32_t i = first; i <= last; ++i) {
      Segment segment;
      segment.length_m = strand.segment_m[i];
      segment.lever_m = std::max(segment.length_m, kMinLengthM);
      const glm::dvec3 rest_edge = rest_m(strand, i) - rest_m(strand, i - 1);
      const glm::dquat rest_next = carried(rest, direction_or(rest_edge, rest * kAlong));
      segment.rest_turn = glm::conjugate(rest) * rest_next;
      rest = rest_next;
      const glm::dvec3 old_edge = strand.old_m[i] - strand.old_m[i - 1];
      glm::dvec3 moved = h_s() * (strand.velocity_mps[i] - strand.velocity_mps[i - 1]);
      if (glm::length(moved) > segment.length_m) moved *= segment.length_m / glm::length(moved);
      old = carried(old, direction_or(old_edge, old_head * (rest * kAlong)));
      now = carried(now, direction_or(old_edge + moved, head * (rest * kAlong)));
      segment.frame = spun(now, strand.memory[i]);
      segment.turn = turn_between(spun(old, strand.memory[i]), segment.frame);
      const double half_mass = 0.5 * segment.lever_m;
      if (i > first) chain.segment.back().mass_m += half_mass * strand.inertia[i - 1];
      segment.mass_m = half_mass * strand.inertia[i];
      segment.aim_m = strand.predicted_m[i];
      total += half_mass;
      chain.segment.push_back(segment);
    }
    if (layout().pinned_tail_count > 0) {
      chain.segment.back().aim_m = strand.target_m[last];
      chain.segment.back().mass_m = 2.0 * kAnchorMass * total;
    }
    return chain;
  }

  /// The joint before a segment; `tension` is the force that stretches the segment.
  Joint joint_at(const Chain& chain, size_t i, double tension_m2ps2) const {
    const Segment& segment = chain.segment[i];
    const glm::dquat before = i > 0 ? chain.segment[i - 1].frame : chain.clamp;
    const glm::dquat rest = before * segment.rest_turn;
    const glm::dvec3 u = rest * kAlong;
    const glm::dvec3 t = segment.along();
    const double span = segment.lever_m + (i > 0 ? chain.segment[i - 1].lever_m : 0.0);
    double bend = 2.0 * parameters_.bend_stiffness_m4ps2 / span;
    if (i == 0) bend = clamp_stiffness(parameters_.bend_stiffness_m4ps2, tension_m2ps2, segment.lever_m);
    const double twist = 2.0 * parameters_.twist_stiffness_m4ps2 / span;

    const double half_sine = std::min(0.5 * glm::distance(u, t), std::sqrt(kMaxHalfSineSquared));
    const double angle = 2.0 * std::asin(half_sine);
    const double per_sine = angle > 1e-9 ? angle / std::sin(angle) : 1.0;
    const glm::dvec3 middle = (u + t) / std::max(1.0 + glm::dot(u, t), kMinOpening);
    const glm::dquat spin = glm::conjugate(carried(rest, t)) * segment.frame;
    const double tau = 2.0 * std::atan2(spin.z, spin.w);
    const double torsion = 2.0 * std::sin(tau) / std::max(1.0 + std::cos(tau), kMinOpening);

    const glm::dvec3 axis = direction_or(middle, t);
    const glm::dmat3 along_axis = glm::outerProduct(axis, axis);
    const glm::dmat3 elastic =
        bend * (glm::dmat3(1.0) - along_axis) + twist * glm::dot(middle, middle) * along_axis;
    const glm::dvec3 turn_before = i > 0 ? chain.segment[i - 1].turn : chain.clamp_turn;
    const double rate = parameters_.damping_s / h_s();
    const double h2 = h_s() * h_s();
    Joint joint;
    joint.moment = h2 * (bend * per_sine * glm::cross(u, t) + twist * torsion * middle +
                         rate * (elastic * (segment.turn - turn_before)));
    joint.stiffness = h2 * (1.0 + rate) * elastic;
    return joint;
  }

  /// One Newton step; false when something came out broken.
  bool turn_segments(Chain& chain) const {
    const size_t n = chain.segment.size();
    DenseSystem system(n);
    std::vector<glm::dvec3> force(n);  // on the vertex at the end, then on everything from there on
    std::vector<double> mass(n);       // the same
    glm::dvec3 position = chain.root_m;
    for (size_t i = 0; i < n; ++i) {
      const Segment& segment = chain.segment[i];
      position += segment.length_m * segment.along();
      force[i] = segment.mass_m * (segment.aim_m - position);
      mass[i] = segment.mass_m;
    }
    for (size_t i = n - 1; i-- > 0;) {
      force[i] += force[i + 1];
      mass[i] += mass[i + 1];
    }
    for (size_t i = 0; i < n; ++i) {
      const Segment& segment = chain.segment[i];
      const glm::dvec3 t = segment.along();
      const glm::dvec3 lever = segment.lever_m * t;
      const double pull = glm::dot(force[i], t);
      // A vertex moves by turn x lever for every segment before it: those of both i and j are beyond i.
      for (size_t j = 0; j <= i; ++j) {
        const glm::dvec3 other = chain.segment[j].lever_m * chain.segment[j].along();
        system.add_block(i, j, mass[i] * glm::transpose(cross_matrix(lever)) * cross_matrix(other));
      }
      const double spin_inertia = kSpinShare * segment.mass_m * segment.lever_m * segment.lever_m;
      const glm::dmat3 along = glm::outerProduct(t, t);
      system.add_block(
          i, i, segment.lever_m * std::max(pull, 0.0) * (glm::dmat3(1.0) - along) + spin_inertia * along);
      system.add_right(i, glm::cross(lever, force[i]));
      const Joint joint = joint_at(chain, i, pull / (h_s() * h_s()));
      system.add_block(i, i, joint.stiffness);
      system.add_right(i, -joint.moment);
      if (i == 0) continue;
      system.add_block(i - 1, i - 1, joint.stiffness);
      system.add_block(i, i - 1, -joint.stiffness);
      system.add_right(i - 1, joint.moment);
    }
    const std::vector<glm::dvec3> turn = system.solve();
    if (turn.empty()) return false;
    for (size_t i = 0; i < n; ++i) {
      if (!std::isfinite(glm::dot(turn[i], turn[i]))) return false;
      const glm::dvec3 limited_turn =
          turn[i] * std::min(1.0, kMaxTurnRad / std::max(glm::length(turn[i]), kTinyLength));
      Segment& segment = chain.segment[i];
      segment.frame = glm::normalize(glm::dquat(1.0, 0.5 * limited_turn) * segment.frame);
      segment.turn += limited_turn;
    }
    return true;
  }

  ChainParameters parameters_;
};

}  // namespace

std::unique_ptr<Solver> make_articulated_reference(const SolverParameters& given) {
  SolverParameters shared = given;
  shared["s_damping"] = 0.0;
  return std::make_unique<ArticulatedReference>(read_strand_parameters(shared), read_chain_parameters(given));
}

}  // namespace strandcast

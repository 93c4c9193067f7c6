// The chain in double: frames as quaternions, the matrix of all segments at once, dense.
#include <algorithm>
#include <cmath>

#include "server/sim/directions.h"
#include "server/sim/reference_chain.h"
#include "server/sim/solvers/articulated/articulated.h"

namespace strandcast {
namespace {

// As in the kernel, which says why.
constexpr double kSpinShare = 1e-4;
constexpr double kMinOpening = 0.1;

const glm::dvec3 kAlongLink(0.0, 0.0, 1.0);  // of a frame: along the segment

/// As four sums beside each other: in one, each addition waits for the one before.
double dot(const double* a, const double* b, size_t count) {
  double sums[4] = {};
  size_t k = 0;
  for (; k + 4 <= count; k += 4)
    for (size_t lane = 0; lane < 4; ++lane) sums[lane] += a[k + lane] * b[k + lane];
  for (; k < count; ++k) sums[0] += a[k] * b[k];
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
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
        const double sum = row[j] - dot(row, other, j);
        if (i == j && !(sum > 0.0)) return {};
        row[j] = i == j ? std::sqrt(sum) : sum / other[j];
      }
      right_side_[i] = (right_side_[i] - dot(row, right_side_.data(), i)) / row[i];
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

struct Joint {
  glm::dvec3 moment{0.0};
  glm::dmat3 stiffness{0.0};
};

class ArticulatedReference final : public ReferenceChain {
 public:
  explicit ArticulatedReference(const SolverParameters& parameters)
      : ReferenceChain(read_strand_parameters(parameters), read_chain_parameters(parameters, "solves")) {}

 private:
  /// The joint before a segment; `tension` is the force that stretches the segment.
  Joint joint_at(const ReferenceChainState& chain, size_t i, double tension_m2ps2) const {
    const ChainSegment& segment = chain.segment[i];
    const glm::dquat before = i > 0 ? chain.segment[i - 1].frame : chain.clamp;
    const glm::dquat rest = before * segment.rest_turn;
    const glm::dvec3 u = rest * kAlongLink;
    const glm::dvec3 t = segment.along();
    const double span = segment.lever_m + (i > 0 ? chain.segment[i - 1].lever_m : 0.0);
    const double bend = bend_stiffness(chain, i, tension_m2ps2);
    const double twist = 2.0 * parameters().twist_stiffness_m4ps2 / span;

    const glm::dvec3 middle = (u + t) / std::max(1.0 + glm::dot(u, t), kMinOpening);
    const glm::dquat spin = glm::conjugate(carried_frame(rest, t)) * segment.frame;
    const double tau = 2.0 * std::atan2(spin.z, spin.w);
    const double torsion = 2.0 * std::sin(tau) / std::max(1.0 + std::cos(tau), kMinOpening);

    const glm::dvec3 axis = direction_or(middle, t);
    const glm::dmat3 along_axis = glm::outerProduct(axis, axis);
    const glm::dmat3 elastic =
        bend * (glm::dmat3(1.0) - along_axis) + twist * glm::dot(middle, middle) * along_axis;
    const glm::dvec3 turn_before = i > 0 ? chain.segment[i - 1].turn : chain.clamp_turn;
    const double rate = parameters().damping_s / h_s();
    const double h2 = h_s() * h_s();
    Joint joint;
    joint.moment = h2 * (bend * bend_between(u, t) + twist * torsion * middle +
                         rate * (elastic * (segment.turn - turn_before)));
    joint.stiffness = h2 * (1.0 + rate) * elastic;
    return joint;
  }

  /// One Newton step; false when something came out broken.
  bool turn_segments(ReferenceChainState& chain) const override {
    const size_t n = chain.segment.size();
    DenseSystem system(n);
    std::vector<glm::dvec3> force(n);  // on the vertex at the end, then on everything from there on
    std::vector<double> mass(n);       // the same
    glm::dvec3 position = chain.root_m;
    for (size_t i = 0; i < n; ++i) {
      const ChainSegment& segment = chain.segment[i];
      position += segment.length_m * segment.along();
      force[i] = segment.mass_m * (segment.aim_m - position);
      mass[i] = segment.mass_m;
    }
    for (size_t i = n - 1; i-- > 0;) {
      force[i] += force[i + 1];
      mass[i] += mass[i + 1];
    }
    for (size_t i = 0; i < n; ++i) {
      const ChainSegment& segment = chain.segment[i];
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
      ReferenceChain::turn(chain.segment[i], turn[i]);
    }
    return true;
  }
};

}  // namespace

std::unique_ptr<Solver> make_articulated_reference(const SolverParameters& parameters) {
  return std::make_unique<ArticulatedReference>(parameters);
}

}  // namespace strandcast

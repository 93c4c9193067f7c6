// BandedSystem: linear systems of the double-precision reference solvers of strands. Header only; one thread.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/glm.hpp>
#include <vector>

namespace strandcast {

/// Symmetric positive definite matrix with kUnknowns per vertex, whose blocks reach kBlocks - 1 vertices off
/// the diagonal. Solved by scalar Cholesky. The first three unknowns of a vertex are a vector.
template <size_t kUnknowns, size_t kBlocks>
class BandedSystem {
 public:
  explicit BandedSystem(size_t vertex_count)
      : band_(kUnknowns * vertex_count * kWidth, 0.0), right_side_(kUnknowns * vertex_count, 0.0) {}

  /// Adds a value at a row and column of unknowns; entries above the diagonal are ignored.
  void add(size_t row, size_t column, double value) {
    if (column <= row) at(row, column) += value;
  }
  void add_block(size_t i, size_t j, const glm::dmat3& block) {
    for (size_t r = 0; r < 3; ++r) {
      for (size_t c = 0; c < 3; ++c)
        add(kUnknowns * i + r, kUnknowns * j + c, block[static_cast<int>(c)][static_cast<int>(r)]);
    }
  }
  void add_right(size_t row, double value) { right_side_[row] += value; }
  void add_force(size_t i, const glm::dvec3& force) {
    for (size_t c = 0; c < 3; ++c) add_right(kUnknowns * i + c, force[static_cast<int>(c)]);
  }

  /// Returns the solution for each vertex, or nothing if a pivot is not positive. Overwrites the system.
  std::vector<glm::vec<static_cast<int>(kUnknowns), double>> solve() {
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
    std::vector<glm::vec<static_cast<int>(kUnknowns), double>> solution(n / kUnknowns);
    for (size_t i = 0; i < n; ++i) solution[i / kUnknowns][static_cast<int>(i % kUnknowns)] = right_side_[i];
    return solution;
  }

 private:
  static constexpr size_t kWidth = kUnknowns * kBlocks;
  double& at(size_t row, size_t column) { return band_[row * kWidth + (row - column)]; }

  std::vector<double> band_;  // lower triangle, (kUnknowns vertex_count x kWidth)
  std::vector<double> right_side_;
};

}  // namespace strandcast

// LeastSquares: weights of a linear prediction from samples, as the small integers that go on the wire.
// Private to common/codec; one thread.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace strandcast {

/// Sums of products of kCount features and, last, of the wanted value; the upper half counts.
template <uint32_t kCount>
using Gram = std::array<std::array<double, kCount + 1>, kCount + 1>;

/// The weights that fit best, in units of `unit`: normal equations by Cholesky with a little ridge and
/// `floor` on the diagonal.
template <uint32_t kCount>
std::array<int16_t, kCount> solve_weights(const Gram<kCount>& gram, double floor, double unit) {
  constexpr double kRidge = 1e-4;
  std::array<std::array<double, kCount>, kCount> factor{};
  std::array<double, kCount> solution{};
  for (uint32_t i = 0; i < kCount; ++i) {
    for (uint32_t j = 0; j <= i; ++j) {
      double sum = gram[j][i];
      if (i == j) sum += kRidge * gram[i][i] + floor;
      for (uint32_t k = 0; k < j; ++k) sum -= factor[i][k] * factor[j][k];
      factor[i][j] = i == j ? std::sqrt(std::max(sum, floor)) : sum / factor[j][j];
    }
    double sum = gram[i][kCount];
    for (uint32_t k = 0; k < i; ++k) sum -= factor[i][k] * solution[k];
    solution[i] = sum / factor[i][i];
  }
  std::array<int16_t, kCount> weights;
  for (uint32_t i = kCount; i-- > 0;) {
    double sum = solution[i];
    for (uint32_t k = i + 1; k < kCount; ++k) sum -= factor[k][i] * solution[k];
    solution[i] = sum / factor[i][i];
    const double scaled = std::isfinite(solution[i]) ? solution[i] / unit : 0.0;
    weights[i] = static_cast<int16_t>(std::lrint(std::clamp(scaled, -32767.0, 32767.0)));
  }
  return weights;
}

/// Collects samples (features, wanted value); features that hardly move get weights near 0. Sums of a batch
/// are floats, those of all batches doubles.
template <uint32_t kCount>
class LeastSquares {
 public:
  void add(const std::array<float, kCount>& value, float wanted) {
    for (uint32_t k = 0; k < kCount; ++k) lanes_[k][filled_] = value[k];
    lanes_[kCount][filled_] = wanted;
    ++count_;
    if (++filled_ == kLanes) flush();
  }

  /// Ends a batch; needed before weights().
  void flush() {
    if (filled_ == 0) return;
    for (auto& term : lanes_) std::fill(term.begin() + filled_, term.end(), 0.0f);
    filled_ = 0;
    for (uint32_t a = 0; a <= kCount; ++a) {
      for (uint32_t b = 0; b <= a; ++b) {
        std::array<float, 8> sum{};
        for (uint32_t i = 0; i < kLanes; i += 8)
          for (uint32_t lane = 0; lane < 8; ++lane) sum[lane] += lanes_[a][i + lane] * lanes_[b][i + lane];
        for (const float part : sum) gram_[b][a] += static_cast<double>(part);
      }
    }
  }

  /// In units of `unit`. Features are taken to be off by `noise`: what moves less predicts nothing.
  std::array<int16_t, kCount> weights(double unit, double noise) const {
    constexpr double kLeast = 1e-9;
    const double floor = std::max(noise * noise * static_cast<double>(count_), kLeast);
    return solve_weights<kCount>(gram_, floor, unit);
  }

 private:
  static constexpr uint32_t kLanes = 64;
  std::array<std::array<float, kLanes>, kCount + 1> lanes_{};
  uint32_t filled_ = 0;
  uint64_t count_ = 0;
  Gram<kCount> gram_{};
};

}  // namespace strandcast

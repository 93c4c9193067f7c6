// LeastSquares: weights of a linear prediction from samples, as the small integers that go on the wire.
// Private to common/strands; one thread.
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
  constexpr double kRidge = 1e-6;
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

/// Collects samples (features, wanted value, by how much it counts). Sums of a batch are floats, those of all
/// batches doubles.
template <uint32_t kCount>
class LeastSquares {
 public:
  void add(const std::array<float, kCount>& value, float wanted, float trust) {
    for (uint32_t k = 0; k < kCount; ++k) lanes_[k][filled_] = trust * value[k];
    lanes_[kCount][filled_] = trust * wanted;
    trust_ += static_cast<double>(trust * trust);
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
        for (uint32_t half = 4; half > 0; half /= 2)
          for (uint32_t lane = 0; lane < half; ++lane) sum[lane] += sum[lane + half];
        gram_[b][a] += static_cast<double>(sum[0]);
      }
    }
  }

  /// In units of `unit`. Features will be off by `noise` when they are used: what moves less predicts
  /// nothing.
  std::array<int16_t, kCount> weights(double unit, const std::array<double, kCount>& noise) const {
    constexpr double kLeast = 1e-9;
    Gram<kCount> blurred = gram_;
    for (uint32_t k = 0; k < kCount; ++k) blurred[k][k] += noise[k] * noise[k] * trust_;
    return solve_weights<kCount>(blurred, kLeast, unit);
  }

 private:
  static constexpr uint32_t kLanes = 128;
  std::array<std::array<float, kLanes>, kCount + 1> lanes_{};
  uint32_t filled_ = 0;
  double trust_ = 0.0;  // sum of squares
  Gram<kCount> gram_{};
};

}  // namespace strandcast

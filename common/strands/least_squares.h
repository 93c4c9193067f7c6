// LeastSquares: fits the weights of a linear prediction to samples and rounds them to the small integers of
// the wire format. Private to common/strands; one thread.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "common/simd/raw_lanes.h"

namespace strandcast {

/// Gram matrix: sums of products of kCount features and, last, the wanted value. Only the upper half is used.
template <uint32_t kCount>
using Gram = std::array<std::array<double, kCount + 1>, kCount + 1>;

/// Returns the best-fitting weights in units of `unit`. Solves the normal equations by Cholesky, with a small
/// ridge and `floor` added to the diagonal.
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

/// Collects samples: features, wanted value and weight of the sample. A batch is summed in floats over eight
/// lanes, the batches in doubles. The order of summation is the same for every instruction set. In a kernel
/// of common/simd it is compiled for that kernel's set.
template <uint32_t kCount>
class LeastSquares {
 public:
  static constexpr uint32_t kTerms = kCount + 1;
  /// Terms of eight samples: the features and, last, the wanted value, each multiplied by the weight of the
  /// sample.
  using Eight = simd::FloatBits[kTerms];

  STRANDCAST_LANES void add(const std::array<float, kCount>& value, float wanted, float trust) {
    auto& eight = batch_[filled_ / simd::kLanes];
    const uint32_t lane = filled_ % simd::kLanes;
    for (uint32_t k = 0; k < kCount; ++k) eight[k][lane] = trust * value[k];
    eight[kCount][lane] = trust * wanted;
    count(trust);
    if (++filled_ == kBatch) flush();
  }

  /// Lets a caller write samples in place, eight at a time. Valid if only whole groups of eight were added
  /// since the last flush(). room(0) .. room(kSpare - 1) are the next groups to fill; add_eights() adds the
  /// first `count`.
  static constexpr uint32_t kSpare = 3;
  STRANDCAST_LANES simd::FloatBits* room(uint32_t i) { return batch_[filled_ / simd::kLanes + i]; }
  STRANDCAST_LANES void add_eights(uint32_t count) {
    filled_ += count * simd::kLanes;
    if (filled_ < kBatch) return;
    const uint32_t rest = filled_ - kBatch;
    filled_ = kBatch;
    flush();
    std::memcpy(batch_[0], batch_[kEights], rest / simd::kLanes * sizeof batch_[0]);
    filled_ = rest;
  }
  /// Adds the weight of one sample; samples come in the order in which they were added.
  STRANDCAST_LANES void count(float trust) { trust_ += static_cast<double>(trust * trust); }

  /// Ends a batch; call it before weights().
  STRANDCAST_LANES void flush() {
    if (filled_ == 0) return;
    for (; filled_ % simd::kLanes != 0; ++filled_)
      for (uint32_t k = 0; k < kTerms; ++k) batch_[filled_ / simd::kLanes][k][filled_ % simd::kLanes] = 0.0f;
    for (; filled_ < kBatch; filled_ += simd::kLanes)
      for (uint32_t k = 0; k < kTerms; ++k) batch_[filled_ / simd::kLanes][k] = simd::FloatBits{};
    filled_ = 0;
    for (uint32_t a = 0; a < kTerms; a += kTile)
      for (uint32_t b = 0; b < std::min(a + kTile, kTerms); b += 2) add_products(a, b);
  }

  /// Returns weights in units of `unit`. `noise` is the expected error of each feature in use; a feature that
  /// varies less than its noise gets little weight.
  std::array<int16_t, kCount> weights(double unit, const std::array<double, kCount>& noise) const {
    constexpr double kLeast = 1e-9;
    Gram<kCount> blurred;
    for (uint32_t a = 0; a < kTerms; ++a) std::copy_n(gram_[a].begin(), kTerms, blurred[a].begin());
    for (uint32_t k = 0; k < kCount; ++k) blurred[k][k] += noise[k] * noise[k] * trust_;
    return solve_weights<kCount>(blurred, kLeast, unit);
  }

 private:
  static constexpr uint32_t kBatch = 128;
  static constexpr uint32_t kEights = kBatch / simd::kLanes;
  static constexpr uint32_t kTile = 4;
  static constexpr uint32_t kPadded = (kTerms + kTile - 1) / kTile * kTile;

  using Four = float __attribute__((vector_size(16)));
  using Doubles = double __attribute__((vector_size(32)));

  /// Sums of four groups of four lanes, added as (0 + 2) + (1 + 3).
  STRANDCAST_LANES static Four sums(const Four (&x)[kTile]) {
    const Four low =
        __builtin_shufflevector(x[0], x[1], 0, 1, 4, 5) + __builtin_shufflevector(x[0], x[1], 2, 3, 6, 7);
    const Four high =
        __builtin_shufflevector(x[2], x[3], 0, 1, 4, 5) + __builtin_shufflevector(x[2], x[3], 2, 3, 6, 7);
    return __builtin_shufflevector(low, high, 0, 2, 4, 6) + __builtin_shufflevector(low, high, 1, 3, 5, 7);
  }

  /// Adds products of the four terms from a on with the two from b on; this many fit into registers.
  STRANDCAST_LANES void add_products(uint32_t a, uint32_t b) {
    simd::FloatBits sum[2][kTile] = {};
    for (uint32_t i = 0; i < kEights; ++i) {
      for (uint32_t k = 0; k < kTile; ++k) {
        sum[0][k] += batch_[i][a + k] * batch_[i][b];
        sum[1][k] += batch_[i][a + k] * batch_[i][b + 1];
      }
    }
    for (uint32_t which = 0; which < 2; ++which) {
      Four halved[kTile];
      for (uint32_t k = 0; k < kTile; ++k) {
        Four part[2];
        std::memcpy(part, &sum[which][k], sizeof part);
        halved[k] = part[0] + part[1];
      }
      Doubles total;
      double* const to = gram_[b + which].data() + a;
      std::memcpy(&total, to, sizeof total);
      total += __builtin_convertvector(sums(halved), Doubles);
      std::memcpy(to, &total, sizeof total);
    }
  }

  simd::FloatBits batch_[kEights + kSpare][kPadded] = {};
  uint32_t filled_ = 0;
  double trust_ = 0.0;  // sum of squares
  std::array<std::array<double, kPadded>, kPadded> gram_{};
};

}  // namespace strandcast

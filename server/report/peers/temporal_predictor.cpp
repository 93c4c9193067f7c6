#include "server/report/peers/temporal_predictor.h"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>

namespace strandcast {
namespace {

constexpr float kWeightSteps = 1024.0f;
constexpr size_t kSampledStrands = 8;  // one in so many is looked at for the weights
// Keep the system solvable when nothing moves, and when features are alike: relative, and in lattice steps.
constexpr double kRidge = 1e-6;
constexpr double kLeastRidge = 1e-3;

}  // namespace

TemporalWeights TemporalPredictor::fit(const IntegerPlanes& now) const {
  TemporalWeights weights{};
  if (last_.value.empty()) return weights;
  glm::dmat4 system(kLeastRidge);
  glm::dvec4 side(0.0);
  const size_t stride = now.strand_count;
  const size_t row_count = now.value.size() / stride;
  for (size_t row = 0; row < row_count; ++row) {
    if (row % now.vertex_count == 0) continue;  // roots stand still
    for (size_t i = row * stride; i < (row + 1) * stride; i += kSampledStrands) {
      const size_t parent = i - stride;
      const glm::dvec4 feature(movement_[i], movement_[i] - movement_before_[i],
                               now.value[parent] - last_.value[parent] - movement_[parent],
                               movement_[parent] - movement_before_[parent]);
      system += glm::outerProduct(feature, feature);
      side += feature * static_cast<double>(now.value[i] - last_.value[i]);
    }
  }
  system += glm::dmat4(kRidge * (system[0][0] + system[1][1] + system[2][2] + system[3][3]));
  const glm::dvec4 solution = glm::inverse(system) * side;
  for (int k = 0; k < 4; ++k) {
    const double steps = std::clamp(solution[k] * static_cast<double>(kWeightSteps), -32768.0, 32767.0);
    weights[static_cast<size_t>(k)] = static_cast<int16_t>(std::isfinite(steps) ? std::lrint(steps) : 0);
  }
  return weights;
}

// Floats do: encoder and decoder run this same code on the same numbers.
std::vector<int32_t> TemporalPredictor::predicted_row(size_t row, const int32_t* now,
                                                      const TemporalWeights& weights) const {
  const size_t stride = last_.strand_count;
  const bool has_parent = row % last_.vertex_count != 0;
  const size_t parent = has_parent ? (row - 1) * stride : row * stride;
  // The parent's values are known on both sides; a root has weights of zero for them.
  const int32_t* parent_now = has_parent ? now + parent : last_.value.data() + parent;
  const int32_t* parent_last = last_.value.data() + parent;
  const int32_t* parent_movement = movement_.data() + parent;
  const int32_t* parent_before = movement_before_.data() + parent;
  const int32_t* movement = movement_.data() + row * stride;
  const int32_t* before = movement_before_.data() + row * stride;
  const int32_t* last = last_.value.data() + row * stride;
  float weight[4];
  for (size_t k = 0; k < 4; ++k)
    weight[k] = k >= 2 && !has_parent ? 0.0f : static_cast<float>(weights[k]) / kWeightSteps;

  std::vector<int32_t> predicted(stride);
  for (size_t s = 0; s < stride; ++s) {
    const float own =
        weight[0] * static_cast<float>(movement[s]) + weight[1] * static_cast<float>(movement[s] - before[s]);
    const float parents =
        weight[2] * static_cast<float>(parent_now[s] - parent_last[s] - parent_movement[s]) +
        weight[3] * static_cast<float>(parent_movement[s] - parent_before[s]);
    const float sum = own + parents;
    predicted[s] = last[s] + static_cast<int32_t>(sum + (sum < 0.0f ? -0.5f : 0.5f));
  }
  return predicted;
}

IntegerPlanes TemporalPredictor::residual(const IntegerPlanes& now, const TemporalWeights& weights) const {
  IntegerPlanes result = now;
  if (last_.value.empty()) return result;
  const size_t stride = now.strand_count;
  for (size_t row = 0; row < now.value.size() / stride; ++row) {
    const std::vector<int32_t> predicted = predicted_row(row, now.value.data(), weights);
    for (size_t s = 0; s < stride; ++s) result.value[row * stride + s] -= predicted[s];
  }
  return result;
}

IntegerPlanes TemporalPredictor::restored(const IntegerPlanes& residual,
                                          const TemporalWeights& weights) const {
  IntegerPlanes result = residual;
  if (last_.value.empty()) return result;
  const size_t stride = residual.strand_count;
  for (size_t row = 0; row < residual.value.size() / stride; ++row) {
    const std::vector<int32_t> predicted = predicted_row(row, result.value.data(), weights);
    for (size_t s = 0; s < stride; ++s) result.value[row * stride + s] += predicted[s];
  }
  return result;
}

void TemporalPredictor::advance(const IntegerPlanes& now) {
  if (last_.value.empty()) {
    movement_.assign(now.value.size(), 0);
    movement_before_ = movement_;
  } else {
    movement_before_.swap(movement_);
    for (size_t i = 0; i < now.value.size(); ++i) movement_[i] = now.value[i] - last_.value[i];
  }
  last_ = now;
}

}  // namespace strandcast

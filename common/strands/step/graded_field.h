// GradedDistance: how finely a model tells the distances of a field, and what is expected of a node by those
// before it. Integers only; header only; private to common/strands/step.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <glm/glm.hpp>
#include <span>

#include "common/kernels/step_input.h"
#include "common/kernels/told_field.h"

namespace strandcast::step {

/// A node by those before it, as if the field were linear along each edge of a cell.
inline int32_t linear_guess(std::span<const int16_t> distance, const glm::uvec3& count,
                            const glm::uvec3& node) {
  const size_t row = count.x, slice = row * count.y;
  const size_t here = node.z * slice + node.y * row + node.x;
  const auto before = [&](bool x, bool y, bool z) -> int32_t {
    if ((x && node.x == 0) || (y && node.y == 0) || (z && node.z == 0)) return 0;
    return distance[here - (x ? 1 : 0) - (y ? row : 0) - (z ? slice : 0)];
  };
  if (node.x == 0) return node.y > 0 ? before(false, true, false) : before(false, false, true);
  if (node.y == 0) return before(true, false, false);
  if (node.z == 0) return before(true, false, false) + before(false, true, false) - before(true, true, false);
  return before(true, false, false) + before(false, true, false) + before(false, false, true) -
         before(true, true, false) - before(true, false, true) - before(false, true, true) +
         before(true, true, true);
}

/// How finely distances are told: nodes beside the skin in eight steps at a time, those farther away in more.
class GradedDistance {
 public:
  /// `most`: of the field.
  GradedDistance(float cell_m, int16_t most)
      : most_(std::max<int32_t>(most, 0)),
        near_(static_cast<int32_t>(limited(static_cast<double>(cell_m) / double{kToldFieldStepM}, 30'000.0)) /
              kNearSteps * kNearSteps) {}

  int32_t level_of(int32_t distance) const {
    const int32_t size = std::abs(distance);
    const int32_t level = size <= near_ ? (size + kNearSteps / 2) / kNearSteps
                                        : near_ / kNearSteps + (size - near_ + kFarSteps / 2) / kFarSteps;
    return distance < 0 ? -level : level;
  }
  int16_t distance_of(int32_t level) const {
    const int32_t size = std::min(std::abs(std::clamp(level, -kMostLevel, kMostLevel)), kMostLevel);
    const int32_t steps =
        size <= near_ / kNearSteps ? size * kNearSteps : near_ + (size - near_ / kNearSteps) * kFarSteps;
    return static_cast<int16_t>(std::clamp(level < 0 ? -steps : steps, -32'767, most_));
  }
  /// Which of the tables: nodes out of reach, near the skin and between differ.
  size_t table_of(int32_t guess) const { return guess >= most_ - 1 ? 0 : std::abs(guess) <= near_ ? 1 : 2; }
  int32_t within(int32_t guess) const { return std::clamp(guess, -32'767, most_); }

 private:
  static constexpr int32_t kNearSteps = 8;
  static constexpr int32_t kFarSteps = 128;
  static constexpr int32_t kMostLevel = 1 << 16;
  int32_t most_;
  int32_t near_;  // about a cell
};

/// A node by those before it: linear_guess() and how distances go on along the axes, in the mean.
inline int32_t curved_guess(std::span<const int16_t> distance, const glm::uvec3& count,
                            const glm::uvec3& node) {
  const int32_t linear = linear_guess(distance, count, node);
  if (node.x < 2 || node.y < 2 || node.z < 2) return linear;
  const size_t row = count.x, slice = row * count.y;
  const size_t here = node.z * slice + node.y * row + node.x;
  int32_t on = 0;
  for (const size_t way : {size_t{1}, row, slice}) on += 2 * distance[here - way] - distance[here - 2 * way];
  return (3 * linear + on) / 6;
}

}  // namespace strandcast::step

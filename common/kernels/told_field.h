// ToldField: a distance field for a viewer that takes the same steps (step_model.h): distances in whole
// steps, near the surface only. Plain data, any thread.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/kernels/strand_passes.h"

namespace strandcast {

/// Step of distances: a third of the finest bound of a stream.
inline constexpr float kToldFieldStepM = 1.0f / 65536.0f;
/// Largest distance that is sent: no strand is turned farther outside, and none comes from deeper inside.
/// Cells away from the surface then cost next to nothing.
inline constexpr double kToldOutsideM = 0.015;
inline constexpr double kToldInsideM = 0.04;
/// A finer field is not told of: strands are predicted without it.
inline constexpr size_t kMostToldNodes = 2'500'000;

struct ToldField {
  FieldGrid grid;
  std::vector<int16_t> distance;  // (z x y x x), x fastest; in kToldFieldStepM
};

/// `quads`: as DistanceField has them, (node_count), the first of each the node itself.
ToldField told_field(const FieldGrid& grid, std::span<const glm::vec4> quads);
/// As kernels look it up: the node and its neighbours at x + 1, y + 1 and both.
std::vector<glm::vec4> field_quads(const ToldField& field);

}  // namespace strandcast

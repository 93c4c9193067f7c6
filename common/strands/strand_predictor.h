// Prediction of the "delta" codec: the lattice velocity of a vertex as a weighted sum of features that both
// sides know. Integer arithmetic wraps around, so encoder and decoder agree bit for bit for all values. No
// I/O; one thread.
//
// Names are those of linear prediction: velocity = lattice now - lattice one frame ago; residual = velocity -
// predicted velocity. Arrays are (3 x vertex_count x strand_count), axis-major, strand fastest.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/strands/wrapping.h"

namespace strandcast {

inline constexpr uint32_t kFeatureCount = 15;
inline constexpr uint32_t kRowClassCount = 3;  // rows 0 to 2; rows in between; the last row
inline constexpr int kWeightShift = 10;        // weights are in 1/1024

/// Weights of one kind of row, in the order of the features listed in strand_predictor.cpp.
using RowWeights = std::array<int16_t, kFeatureCount>;
using PredictorWeights = std::array<RowWeights, kRowClassCount>;

/// State of the codec after the last frame, equal on both sides.
struct StrandChain {
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;
  std::vector<int32_t> lattice;
  std::vector<int32_t> velocity;
  std::vector<int32_t> residual;
  std::vector<uint32_t> neighbour;  // (strand_count) a strand near by with a smaller index; itself = none
  std::vector<uint32_t> second_neighbour;  // (strand_count) likewise

  size_t plane_size() const { return static_cast<size_t>(strand_count) * vertex_count; }
};

/// Finds for each strand the two nearest roots among strands of smaller index. Approximate: it searches near
/// the root on a Morton curve.
void find_neighbours(StrandChain& chain);
/// Fits weights that predict `velocity` from `chain`, by least squares over a sample of strands. Uses plain
/// extrapolation or no motion where one of these is better.
PredictorWeights fit_weights(const StrandChain& chain, const std::vector<int32_t>& velocity);

/// Returns velocity - prediction for every vertex.
std::vector<int32_t> find_residual(const StrandChain& chain, const PredictorWeights& weights,
                                   const std::vector<int32_t>& velocity);

/// Returns prediction + residual: the inverse of find_residual().
std::vector<int32_t> find_velocity(const StrandChain& chain, const PredictorWeights& weights,
                                   const std::vector<int32_t>& residual);

}  // namespace strandcast

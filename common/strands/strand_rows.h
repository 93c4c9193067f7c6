// The prediction of strand_predictor.h for one row (one axis of one vertex index, all strands), for codecs
// that process row by row. Private to common/strands; one thread.
#pragma once

#include "common/simd/variants.h"
#include "common/strands/strand_predictor.h"

namespace strandcast {

// Features, all of them lattice velocities or residuals. "now" is the frame being coded, "then" the one
// before; the parent is the vertex nearer to the root, a neighbour the same vertex of a strand near by.
//   0 own then          1 own residual then
//   2 parent now        3 parent then          4 parent residual then
//   5 grandparent now   6 grandparent then     7 child then            8 child residual then
//   9 neighbour now    10 neighbour then      11 neighbour residual then
//  12 second now       13 second then         14 second residual then
inline constexpr uint32_t kRowFeatureCount = 9;  // those that lie in whole rows
inline constexpr int32_t kPredictionRound = 1 << (kWeightShift - 1);

struct RowFeatures {
  std::array<const int32_t*, kRowFeatureCount> row;  // each (strand_count)
  const int32_t* now;                                // this row, for the neighbours
  const int32_t* then;
  const int32_t* residual_then;
};

/// Returns the class of weights that a vertex index uses.
inline uint32_t row_class(uint32_t vertex_index, uint32_t vertex_count) {
  if (vertex_index < 3) return 0;
  return vertex_index + 1 == vertex_count ? 2 : 1;
}

/// Returns the features of a row. `now`: velocities of this frame (3 x vertex_count x strand_count), known
/// for earlier rows. `zeros`: strand_count zeros, used where a feature does not exist.
RowFeatures row_features(const StrandChain& chain, const int32_t* now, const int32_t* zeros, size_t axis,
                         uint32_t vertex_index);

struct RowSums {
  const RowFeatures& features;
  const RowWeights& weights;
  uint32_t* sum;
  size_t count;
};
/// Computes for all s below `count`: sum[s] = rounding + weighted sum of the features that are whole rows. A
/// kernel for every instruction set, all with the same bits.
void sum_rows(simd::InstructionSet set, const RowSums& of);

/// Weights and rows of the features that come from neighbouring strands.
struct NeighbourTerms {
  std::array<uint32_t, kFeatureCount - kRowFeatureCount> w;

  explicit NeighbourTerms(const RowWeights& weights) {
    for (uint32_t k = 0; k < w.size(); ++k)
      w[k] = static_cast<uint32_t>(int32_t{weights[kRowFeatureCount + k]});
  }
  /// Adds the neighbours' terms for strand s to `sum` and returns the predicted velocity.
  int32_t predict(const StrandChain& chain, const RowFeatures& features, uint32_t sum, size_t s) const {
    const uint32_t n = chain.neighbour[s];
    const uint32_t m = chain.second_neighbour[s];
    if (n != s) {
      sum += w[0] * static_cast<uint32_t>(features.now[n]) + w[1] * static_cast<uint32_t>(features.then[n]) +
             w[2] * static_cast<uint32_t>(features.residual_then[n]);
    }
    if (m != s) {
      sum += w[3] * static_cast<uint32_t>(features.now[m]) + w[4] * static_cast<uint32_t>(features.then[m]) +
             w[5] * static_cast<uint32_t>(features.residual_then[m]);
    }
    return static_cast<int32_t>(sum) >> kWeightShift;
  }
};

}  // namespace strandcast

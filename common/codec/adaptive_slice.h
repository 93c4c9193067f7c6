// What the "adaptive" codec does for one slice: a range of strands coded without looking at the others, so
// that slices can be worked on side by side. Private to common/codec. Functions touch only their own slice of
// the arrays, so different slices of one frame may run on different threads.
#pragma once

#include "common/codec/strand_predictor.h"
#include "common/codec/value_coder.h"

namespace strandcast {

inline constexpr uint32_t kMaxSliceCount = 8;
inline constexpr int kResidualBits = 2;          // residuals are kept in 1/4 lattice steps
inline constexpr uint32_t kMaxMagnitude = 1000;  // of a residual; the sums of six fit in 16 bits

// One table for each axis position, expected size and distance of the prediction from a lattice point.
inline constexpr uint32_t kFractionCount = 4;
inline constexpr uint32_t kSizeCount = 25;
inline constexpr uint32_t kTableCount = 3 * kSizeCount * kFractionCount;
using SymbolTables = std::array<SymbolTable, kTableCount>;

SymbolTables make_first_tables();

/// The mean of the tables that the slices of a frame ended with: the next frame starts from it.
SymbolTables mean_tables(std::span<const SymbolTables> tables);

/// Everything both sides remember. Strands lie in codec order: along a curve through the roots.
struct AdaptiveChain {
  StrandChain motion;               // residual in 1/4; neighbours lie in the same slice
  std::vector<uint32_t> order;      // (strand_count) place in codec order -> strand
  std::vector<uint16_t> magnitude;  // (3 x vertex_count x strand_count) of the residuals
  uint32_t slice_count = 1;
  SymbolTables tables;

  size_t slice_begin(uint32_t slice) const {
    return static_cast<size_t>(motion.strand_count) * slice / slice_count;
  }
};

/// A frame being coded after `chain`; arrays of the chain's size.
struct AdaptiveFrame {
  std::vector<int32_t> velocity;
  std::vector<int32_t> residual;
  std::vector<uint16_t> magnitude;

  void resize(size_t value_count);
};

uint16_t residual_magnitude(int32_t residual);

/// Fills residual and magnitude of the slice from its velocity.
void write_motion(const AdaptiveChain& chain, const PredictorWeights& weights, uint32_t slice,
                  AdaptiveFrame& frame, SymbolTables& tables, ValueWriter& writer);
/// The inverse: fills velocity, residual and magnitude.
void read_motion(const AdaptiveChain& chain, const PredictorWeights& weights, uint32_t slice,
                 AdaptiveFrame& frame, SymbolTables& tables, ValueReader& reader);

/// A chain of the same shape that remembers no motion: what the arrays of a keyframe are coded after.
AdaptiveChain without_history(const AdaptiveChain& chain);

/// Each vertex less the one before it on its strand; roots as they are.
std::vector<int32_t> edges_of(const StrandChain& chain);
/// The inverse of edges_of.
std::vector<int32_t> lattice_of(const StrandChain& chain, std::vector<int32_t> edge);

}  // namespace strandcast

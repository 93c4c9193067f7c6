// Entropy coding of the "tangent" codec: codes the integers of a frame with tables chosen by nearby integers.
// No floats affect the choice of a table, so this pass is independent of the geometry. Private to
// common/strands/tangent. Functions touch only their own slice of the arrays.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/strands/tangent/layout.h"
#include "common/strands/tangent/motion.h"
#include "common/strands/value_coder.h"

namespace strandcast::tangent {

inline constexpr uint32_t kSizeCount = 28;  // classes of expected size
inline constexpr uint32_t kFirstSizes = 4;  // the second coordinate is also told apart by the first
inline constexpr uint32_t kLengthTableCount = 15;
inline constexpr uint32_t kTableCount = kSizeCount * (1 + kFirstSizes) + kLengthTableCount;
using Tables = std::array<SymbolTable, kTableCount>;

Tables make_first_tables();

/// Returns the mean of the tables that the slices of a frame ended with; the next frame starts from it.
Tables mean_tables(std::span<const Tables> tables);

/// Clamped magnitudes of the integers of one frame, (vertex_count x stride).
struct SymbolSizes {
  std::vector<uint16_t> across;
  std::vector<uint8_t> length;

  void reset(const Layout& layout);
};

/// Writes the weights of the first classes, each as differences from the class before.
void write_weights(uint32_t class_count, const MotionWeights& weights, ValueWriter& writer);
/// Inverse of write_weights() for untrusted bytes; any bytes give some weights.
void read_weights(uint32_t class_count, MotionWeights& weights, ValueReader& reader);

/// Inputs for writing a slice: `then` holds the sizes of the preceding frame, `now` is filled.
struct SymbolWriting {
  const Layout& layout;
  uint32_t slice;
  const Codes& codes;
  const SymbolSizes& then;
  SymbolSizes& now;
  Tables& tables;
  ValueWriter& writer;
};
/// Writes a slice's integers and escapes. A kernel for every instruction set.
void write_symbols(simd::InstructionSet set, const SymbolWriting& of);

/// Inputs for reading a slice.
struct SliceSymbols {
  uint32_t slice;
  Tables& tables;
  ValueReader& reader;
};
/// Number of slices that are read side by side: a symbol depends on the preceding one of its slice, but on no
/// other slice.
inline constexpr uint32_t kMostSlicesAtOnce = 4;
struct SymbolReading {
  const Layout& layout;
  const SymbolSizes& then;
  Codes& codes;
  SymbolSizes& now;
  std::span<SliceSymbols> slices;  // one to kMostSlicesAtOnce
  Neighbours Layout::*beside = &Layout::neighbour;
};
/// Inverse of write_symbols() for untrusted bytes. Any bytes give some integers; escapes take bytes, so their
/// number is bounded. A kernel for every instruction set.
void read_symbols(simd::InstructionSet set, const SymbolReading& of);

}  // namespace strandcast::tangent

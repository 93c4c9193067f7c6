// Entropy coding of the "tangent" codec: the integers of a frame, with tables chosen by the integers coded
// near by. No floats decide about a table, so this pass needs nothing of the geometry. Private to
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

/// The mean of the tables that the slices of a frame ended with: the next frame starts from it.
Tables mean_tables(std::span<const Tables> tables);

/// Sizes of the integers of one frame, (vertex_count x stride).
struct SymbolSizes {
  std::vector<uint16_t> across;
  std::vector<uint8_t> length;

  void reset(const Layout& layout);
};

/// Weights of the first classes, each told by how far it is from that of the class before.
void write_weights(uint32_t class_count, const MotionWeights& weights, ValueWriter& writer);
/// The inverse, from untrusted bytes: any bytes give some weights.
void read_weights(uint32_t class_count, MotionWeights& weights, ValueReader& reader);

/// A slice to be written; `then` are the sizes of the frame before, `now` is filled.
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

/// A slice to be read.
struct SliceSymbols {
  uint32_t slice;
  Tables& tables;
  ValueReader& reader;
};
/// As many are read side by side: a symbol waits for the one before it in its slice, but for no other slice.
inline constexpr uint32_t kMostSlicesAtOnce = 4;
struct SymbolReading {
  const Layout& layout;
  const SymbolSizes& then;
  Codes& codes;
  SymbolSizes& now;
  std::span<SliceSymbols> slices;  // one to kMostSlicesAtOnce
};
/// The inverse, from untrusted bytes: any bytes give some integers; escapes take bytes, so there are no more
/// than there is room for. A kernel for every instruction set.
void read_symbols(simd::InstructionSet set, const SymbolReading& of);

}  // namespace strandcast::tangent

// Entropy coding of frames whose integers are nearly all 0, as those that steps predict: for each block of
// eight strands' vertices whether any of it is not 0, and the integers of those blocks only, all slices in
// one run of symbols. Private to common/strands/tangent; any thread.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/strands/tangent/symbols.h"

namespace strandcast::tangent {

inline constexpr uint32_t kBlockTableCount = 48;

struct SparseTables {
  std::array<SymbolTable, kBlockTableCount> block;
  Tables vertex;

  bool operator==(const SparseTables&) const = default;
};
SparseTables make_first_sparse_tables();

/// Vertices of each block that were not 0, (vertex_count x blocks).
using BlockCounts = std::vector<uint8_t>;
inline size_t block_count_of(const Layout& layout) {
  return layout.plane_size() / kBlockSize;
}

/// What both directions have in common; `now` is filled.
struct SparseContext {
  const Layout& layout;
  const SymbolSizes& then;
  SymbolSizes& now;
  const BlockCounts& blocks_then;
  BlockCounts& blocks_now;
  SparseTables& tables;
};
void write_sparse(const SparseContext& context, const Codes& codes, ValueWriter& writer);
/// From untrusted bytes: any bytes give some integers, and escapes take bytes.
void read_sparse(const SparseContext& context, ValueReader& reader, Codes& codes);

}  // namespace strandcast::tangent

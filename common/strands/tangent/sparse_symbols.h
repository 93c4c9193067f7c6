// Entropy coding of frames whose integers are nearly all 0, as after solver steps. Each block of eight
// vertices has a flag for any non-zero integer, and only flagged blocks have integers. All slices share one
// run of symbols. Private to common/strands/tangent; any thread.
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

/// Number of non-zero vertices of each block, (vertex_count x blocks).
using BlockCounts = std::vector<uint8_t>;
inline size_t block_count_of(const Layout& layout) {
  return layout.plane_size() / kBlockSize;
}

/// Inputs of writing and reading; `now` is filled.
struct SparseContext {
  const Layout& layout;
  const SymbolSizes& then;
  SymbolSizes& now;
  const BlockCounts& blocks_then;
  BlockCounts& blocks_now;
  SparseTables& tables;
};
void write_sparse(const SparseContext& context, const Codes& codes, ValueWriter& writer);
/// Reads integers from untrusted bytes. Any bytes give some integers, and every escape takes bytes, so memory
/// stays bounded.
void read_sparse(const SparseContext& context, ValueReader& reader, Codes& codes);

}  // namespace strandcast::tangent

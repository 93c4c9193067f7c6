#include "common/strands/tangent/sparse_symbols.h"

#include "common/strands/tangent/symbol_rows.h"

namespace strandcast::tangent {
namespace {

/// Which table tells whether a block has anything: by how much there is at the parent, in the frame before
/// and in the block before it.
class BlockRow {
 public:
  BlockRow(const SparseContext& context, uint32_t v)
      : blocks_(block_count_of(context.layout) / context.layout.vertex_count),
        now_(context.blocks_now.data() + v * blocks_),
        parent_(v > 0 ? now_ - blocks_ : nullptr),
        then_(context.blocks_then.data() + v * blocks_),
        child_then_(v + 1 < context.layout.vertex_count ? then_ + blocks_ : nullptr) {}

  uint32_t table(size_t block) const {
    const uint32_t parent = parent_ == nullptr ? 0 : std::min<uint32_t>(parent_[block], 3);
    const uint32_t then =
        std::min<uint32_t>(2u * then_[block] + (child_then_ == nullptr ? 0 : child_then_[block]), 15);
    const uint32_t then_class = then == 0 ? 0 : then < 3 ? 1 : then < 7 ? 2 : 3;
    const uint32_t before = block == 0 ? 0 : std::min<uint32_t>(now_[block - 1], 2);
    return (parent * 4 + then_class) * 3 + before;
  }
  void set(size_t block, uint32_t count) { now_[block] = static_cast<uint8_t>(count); }

 private:
  size_t blocks_;
  uint8_t* now_;
  const uint8_t* parent_;
  const uint8_t* then_;
  const uint8_t* child_then_;
};

bool is_zero(const Codes& codes, size_t at) {
  return (codes.first[at] | codes.second[at] | codes.length[at]) == 0;
}

/// visit(v, slice, row of sizes, first place of a block, strands in it, blocks) for all blocks in coding
/// order.
template <class Visit>
void for_each_block(const SparseContext& context, Visit visit) {
  const Layout& layout = context.layout;
  SizeRows sizes(layout, layout.neighbour, context.then, context.now);
  for (uint32_t v = 0; v < layout.vertex_count; ++v) {
    // What is not visited is 0.
    const size_t begin = v * size_t{layout.stride};
    std::memset(context.now.across.data() + begin, 0, layout.stride * sizeof(uint16_t));
    BlockRow blocks(context, v);
    for (uint32_t slice = 0; slice < layout.slice_count(); ++slice) {
      const size_t first = layout.slice_begin[slice];
      const size_t count = layout.strands_in[slice];
      const SymbolRow row = sizes.begin_row(v, first, count);
      for (size_t place = first; place < first + count; place += kBlockSize)
        visit(v, slice, row, place, std::min<size_t>(kBlockSize, first + count - place), blocks);
    }
    blocks.set(layout.no_neighbour() / kBlockSize, 0);
  }
}

}  // namespace

SparseTables make_first_sparse_tables() {
  SparseTables tables;
  tables.block.fill(first_table());
  tables.vertex = make_first_tables();
  return tables;
}

void write_sparse(const SparseContext& context, const Codes& codes, ValueWriter& writer) {
  const TableSet tables(context.tables.vertex);
  std::vector<size_t> escapes(context.layout.slice_count(), 0);
  for_each_block(context, [&](uint32_t v, uint32_t slice, const SymbolRow& row, size_t place, size_t strands,
                              BlockRow& blocks) {
    const size_t begin = v * size_t{context.layout.stride};
    const size_t block = place / kBlockSize;
    uint32_t count = 0;
    for (size_t i = 0; i < strands; ++i) count += is_zero(codes, begin + place + i) ? 0 : 1;
    writer.put(count == 0 ? 0 : 1, context.tables.block[blocks.table(block)], 0);
    blocks.set(block, count);
    if (count == 0) return;
    for (size_t i = place; i < place + strands; ++i) {
      const uint32_t length = codes.length[begin + i];
      const uint32_t first = codes.first[begin + i];
      const uint32_t second = codes.second[begin + i];
      with_size(row.near(i), [&](const auto size) {
        writer.put(length, tables.length[size.length + row.known_length[i]], 0);
        row.length[i] = length_size(length);
        if (length == kEscapedFolded) {
          row.across[i] = kEscapeSize;
          return write_escape(codes.escapes[slice][escapes[slice]++], writer);
        }
        writer.put(first, tables.first[size.size], size.shift);
        writer.put(second, tables.second[size.second_table(first)], size.shift);
        row.across[i] = across_size(first, second);
      });
    }
  });
}

void read_sparse(const SparseContext& context, ValueReader& reader, Codes& codes) {
  const TableSet tables(context.tables.vertex);
  for (auto& escapes : codes.escapes) escapes.clear();
  for (auto* values : {&codes.first, &codes.second, &codes.length})
    std::fill(values->begin(), values->end(), 0u);
  for_each_block(context, [&](uint32_t v, uint32_t slice, const SymbolRow& row, size_t place, size_t strands,
                              BlockRow& blocks) {
    const size_t begin = v * size_t{context.layout.stride};
    const size_t block = place / kBlockSize;
    const bool has_any = reader.take(context.tables.block[blocks.table(block)], 0) != 0;
    uint32_t count = 0;
    for (size_t i = place; has_any && i < place + strands; ++i) {
      with_size(row.near(i), [&](const auto size) {
        const uint32_t length = reader.take(tables.length[size.length + row.known_length[i]], 0);
        codes.length[begin + i] = length;
        row.length[i] = length_size(length);
        if (length == kEscapedFolded) {
          ++count;
          row.across[i] = kEscapeSize;
          if (!reader.is_short()) codes.escapes[slice].push_back({begin + i, read_escape(reader)});
          return;
        }
        const uint32_t first = reader.take(tables.first[size.size], size.shift);
        const uint32_t second = reader.take(tables.second[size.second_table(first)], size.shift);
        codes.first[begin + i] = first;
        codes.second[begin + i] = second;
        row.across[i] = across_size(first, second);
        count += (first | second | length) == 0 ? 0 : 1;
      });
    }
    blocks.set(block, count);
  });
}

}  // namespace strandcast::tangent

#include "common/strands/tangent/fine_symbols.h"

#include <algorithm>

#include "common/strands/step/numbers.h"
#include "common/strands/tangent/symbol_rows.h"

namespace strandcast::tangent {
namespace {

/// Tables of a vertex's integers.
struct FineVertexTables {
  step::NumberTables first, second, length;
};

/// Sizes of integers at one place, and at those beside it.
struct FineSizes {
  const Layout& layout;
  const Codes& codes;
  size_t place;

  uint32_t first(size_t other, uint32_t v) const { return codes.first[v * size_t{layout.stride} + other]; }
  uint32_t second(size_t other, uint32_t v) const { return codes.second[v * size_t{layout.stride} + other]; }
  size_t beside(size_t i) const { return layout.alike[i][place]; }

  uint32_t beside_first(uint32_t v) const {
    uint32_t sum = first(beside(0), v) + first(beside(1), v);
    sum += (second(beside(0), v) + second(beside(1), v)) / 2;
    if (v >= 1) sum += 2 * first(place, v - 1) + second(place, v - 1);
    return v >= 2 ? sum + first(place, v - 2) : sum;
  }
  uint32_t beside_second(uint32_t v) const {
    uint32_t sum = second(beside(0), v) + second(beside(1), v) + 2 * first(place, v);
    if (v >= 1) sum += 2 * second(place, v - 1) + first(place, v - 1) / 2;
    return v >= 2 ? sum + second(place, v - 2) : sum;
  }
};

/// Calls code(slice, place, v) for every vertex, strand by strand.
template <class Code>
void for_vertices(const Layout& layout, Code code) {
  for (uint32_t slice = 0; slice < layout.slice_count(); ++slice) {
    const size_t begin = layout.slice_begin[slice];
    for (size_t place = begin; place < begin + layout.strands_in[slice]; ++place)
      for (uint32_t v = 0; v < layout.vertex_count; ++v) code(slice, place, v);
  }
}

/// Escapes in the order of places are in that of rows otherwise.
bool is_before(const Escape& escape, size_t at) {
  return escape.at < at;
}

}  // namespace

void write_fine(const Layout& layout, const Codes& codes, ValueWriter& writer) {
  FineVertexTables tables;
  for_vertices(layout, [&](uint32_t slice, size_t place, uint32_t v) {
    const FineSizes sizes{layout, codes, place};
    const size_t at = v * size_t{layout.stride} + place;
    tables.length.put_beside(unfold_sign(codes.length[at]), 0, writer);
    if (codes.length[at] == kEscapedFolded) {
      const auto& escapes = codes.escapes[slice];
      return write_escape(*std::lower_bound(escapes.begin(), escapes.end(), at, is_before), writer);
    }
    tables.first.put_beside(unfold_sign(codes.first[at]), sizes.beside_first(v), writer);
    tables.second.put_beside(unfold_sign(codes.second[at]), sizes.beside_second(v), writer);
  });
}

void read_fine(const Layout& layout, ValueReader& reader, Codes& codes) {
  for (auto& escapes : codes.escapes) escapes.clear();
  FineVertexTables tables;
  for_vertices(layout, [&](uint32_t slice, size_t place, uint32_t v) {
    const FineSizes sizes{layout, codes, place};
    const size_t at = v * size_t{layout.stride} + place;
    codes.first[at] = codes.second[at] = 0;
    codes.length[at] = fold_sign(tables.length.take_beside(0, reader));
    if (codes.length[at] == kEscapedFolded) {
      if (!reader.is_short()) codes.escapes[slice].push_back({at, read_escape(reader)});
      return;
    }
    codes.first[at] = fold_sign(tables.first.take_beside(sizes.beside_first(v), reader));
    codes.second[at] = fold_sign(tables.second.take_beside(sizes.beside_second(v), reader));
  });
  for (auto& escapes : codes.escapes)
    std::sort(escapes.begin(), escapes.end(), [](const Escape& a, const Escape& b) { return a.at < b.at; });
}

}  // namespace strandcast::tangent

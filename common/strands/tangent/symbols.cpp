#include "common/strands/tangent/symbols.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "common/base/check.h"
#include "common/strands/tangent/symbol_rows.h"

namespace strandcast::tangent {
namespace {

STRANDCAST_LANES void write_symbols_lanes(const SymbolWriting& of) {
  const size_t begin = of.layout.slice_begin[of.slice];
  const size_t count = of.layout.strands_in[of.slice];
  const TableSet tables(of.tables);
  auto escape = of.codes.escapes[of.slice].begin();
  SizeRows sizes(of.layout, of.layout.neighbour, of.then, of.now);
  for (uint32_t v = 0; v < of.layout.vertex_count; ++v) {
    const size_t at = v * static_cast<size_t>(of.layout.stride);
    const uint32_t* const first = of.codes.first.data() + at;
    const uint32_t* const second = of.codes.second.data() + at;
    const uint32_t* const length = of.codes.length.data() + at;
    const SymbolRow row = sizes.begin_row(v, begin, count);
    for (size_t place = begin; place < begin + count; ++place)
      row.across[place] = length[place] == kEscapedFolded ? static_cast<uint16_t>(kEscapeSize)
                                                          : across_size(first[place], second[place]);
    for (size_t place = begin; place < begin + count; ++place) row.length[place] = length_size(length[place]);
    SymbolStep* next = of.writer.begin_run(3 * count);
    for (size_t place = begin; place < begin + count; ++place) {
      with_size(row.near(place), [&](const auto size) STRANDCAST_LANES_LAMBDA {
        of.writer.put(length[place], tables.length[size.length + row.known_length[place]], 0, next);
        if (length[place] == kEscapedFolded) [[unlikely]]
          return write_escape(*escape++, of.writer);
        of.writer.put(first[place], tables.first[size.size], size.shift, next);
        of.writer.put(second[place], tables.second[size.second_table(first[place])], size.shift, next);
      });
    }
    of.writer.end_run(next);
  }
}

/// One of the slices that are read side by side.
struct SliceReader {
  size_t begin;
  size_t count;
  TableSet tables;
  ValueReader& reader;
  std::vector<Escape>& escapes;
};

/// The integers of a row.
struct CodeRow {
  uint32_t* first;
  uint32_t* second;
  uint32_t* length;  // zeros
  size_t at;         // in a plane

  STRANDCAST_LANES CodeRow(Codes& codes, size_t begin)
      : first(codes.first.data() + begin),
        second(codes.second.data() + begin),
        length(codes.length.data() + begin),
        at(begin) {}
};

/// A length that is not 0; true when the vertex is escaped.
STRANDCAST_LANES bool read_length(const SliceReader& slice, SymbolCursor& cursor, SymbolTable& table,
                                  const SymbolRow& row, const CodeRow& codes, size_t place) {
  const uint32_t length = slice.reader.value_of(cursor.take(table), 0);
  codes.length[place] = length;
  row.length[place] = length_size(length);
  if (length != kEscapedFolded) return false;
  codes.first[place] = codes.second[place] = 0;
  row.across[place] = kEscapeSize;
  if (!slice.reader.is_short()) slice.escapes.push_back({codes.at + place, read_escape(slice.reader)});
  return true;
}

STRANDCAST_LANES void read_vertex(const SliceReader& slice, SymbolCursor& cursor, const SymbolRow& row,
                                  const CodeRow& codes, size_t place) {
  with_size(row.near(place), [&](const auto size) STRANDCAST_LANES_LAMBDA {
    SymbolTable& lengths = slice.tables.length[size.length + row.known_length[place]];
    if (!cursor.take_zero(lengths)) [[unlikely]]
      if (read_length(slice, cursor, lengths, row, codes, place)) return;
    const uint32_t first = slice.reader.value_of(cursor.take(slice.tables.first[size.size]), size.shift);
    const uint32_t second =
        slice.reader.value_of(cursor.take(slice.tables.second[size.second_table(first)]), size.shift);
    codes.first[place] = first;
    codes.second[place] = second;
    row.across[place] = across_size(first, second);
  });
}

/// As many slices side by side as there are k.
template <size_t... k>
STRANDCAST_LANES void read_slices(const SymbolReading& of, std::index_sequence<k...>) {
  constexpr size_t kAtOnce = sizeof...(k);
  const auto make_reader = [&](const SliceSymbols& symbols) STRANDCAST_LANES_LAMBDA {
    of.codes.escapes[symbols.slice].clear();
    return SliceReader{of.layout.slice_begin[symbols.slice], of.layout.strands_in[symbols.slice],
                       TableSet(symbols.tables), symbols.reader, of.codes.escapes[symbols.slice]};
  };
  const std::array<SliceReader, kAtOnce> slices = {make_reader(of.slices[k])...};
  const size_t common = std::min({slices[k].count...});
  SizeRows sizes(of.layout, of.layout.*of.beside, of.then, of.now);
  for (uint32_t v = 0; v < of.layout.vertex_count; ++v) {
    const CodeRow codes(of.codes, v * static_cast<size_t>(of.layout.stride));
    for (const SliceReader& slice : slices)
      std::memset(codes.length + slice.begin, 0, slice.count * sizeof(uint32_t));
    const std::array<SymbolRow, kAtOnce> rows = {sizes.begin_row(v, slices[k].begin, slices[k].count)...};
    std::array<SymbolCursor, kAtOnce> cursors = {slices[k].reader.begin_run(3 * slices[k].count)...};
    for (size_t i = 0; i < common; ++i)
      (read_vertex(slices[k], cursors[k], rows[0], codes, slices[k].begin + i), ...);
    // Few: one copy of the code does. In an array of their own, so that those above stay in registers.
    std::array<SymbolCursor, kAtOnce> rest = cursors;
    for (size_t slice = 0; slice < kAtOnce; ++slice) {
      for (size_t i = common; i < slices[slice].count; ++i)
        read_vertex(slices[slice], rest[slice], rows[0], codes, slices[slice].begin + i);
      slices[slice].reader.end_run(rest[slice]);
    }
  }
}

STRANDCAST_LANES void read_symbols_lanes(const SymbolReading& of) {
  if (of.slices.size() == kMostSlicesAtOnce)
    return read_slices(of, std::make_index_sequence<kMostSlicesAtOnce>());
#ifdef __EMSCRIPTEN__  // each number of slices is code that a browser loads
  for (size_t k = 0; k < of.slices.size(); ++k) {
    SymbolReading one = of;
    one.slices = of.slices.subspan(k, 1);
    read_slices(one, std::make_index_sequence<1>());
  }
#else
  switch (of.slices.size()) {
    case 1:
      return read_slices(of, std::make_index_sequence<1>());
    case 2:
      return read_slices(of, std::make_index_sequence<2>());
    default:
      CHECK(of.slices.size() == 3);
      return read_slices(of, std::make_index_sequence<3>());
  }
#endif
}

/// code(difference to the class before, table, shift) -> that difference, for all weights.
template <class Code>
void code_weights(uint32_t class_count, MotionWeights& weights, Code code) {
  constexpr uint32_t kLargest = UINT16_MAX;
  SymbolTable table = first_table();
  std::array<uint32_t, kMotionFeatureCount + 1> size{};  // of the differences of a class, and one more
  MotionWeights::value_type before{};
  for (uint32_t c = 0; c < class_count; ++c) {
    uint32_t left = 0;
    for (uint32_t k = 0; k < kMotionFeatureCount; ++k) {
      // Four times what is likely, from the weight before and the same ones of the class before.
      const uint32_t near = c == 0 ? 4 * left : left + 2 * size[k] + size[k + 1];
      const auto width = static_cast<uint32_t>(std::bit_width(near / 2));
      const int32_t difference = code(weights[c][k] - before[k], table, width < 2 ? 0 : width - 2);
      weights[c][k] =
          static_cast<int16_t>(static_cast<uint32_t>(int32_t{before[k]}) + static_cast<uint32_t>(difference));
      left = std::min(magnitude(fold_sign(difference)), kLargest);
      size[k] = left;
    }
    before = weights[c];
  }
}

}  // namespace

void write_weights(uint32_t class_count, const MotionWeights& weights, ValueWriter& writer) {
  MotionWeights copy = weights;
  code_weights(class_count, copy, [&](int32_t difference, SymbolTable& table, uint32_t shift) {
    writer.put(fold_sign(difference), table, shift);
    return difference;
  });
}

void read_weights(uint32_t class_count, MotionWeights& weights, ValueReader& reader) {
  weights = {};
  code_weights(class_count, weights, [&](int32_t, SymbolTable& table, uint32_t shift) {
    return unfold_sign(reader.take(table, shift));
  });
}

Tables make_first_tables() {
  Tables tables;
  tables.fill(first_table());
  return tables;
}

Tables mean_tables(std::span<const Tables> tables) {
  Tables mean;
  for (size_t i = 0; i < kTableCount; ++i) {
    for (uint32_t k = 0; k < kSymbolCount; ++k) {
      int32_t sum = 0;
      for (const Tables& one : tables) sum += one[i].start[k];
      mean[i].start[k] = static_cast<int16_t>(sum / static_cast<int32_t>(tables.size()));
    }
  }
  return mean;
}

void SymbolSizes::reset(const Layout& layout) {
  across.assign(layout.plane_size(), 0);
  length.assign(layout.plane_size(), 0);
}

STRANDCAST_KERNEL(write_symbols, SymbolWriting);
STRANDCAST_KERNEL(read_symbols, SymbolReading);

}  // namespace strandcast::tangent

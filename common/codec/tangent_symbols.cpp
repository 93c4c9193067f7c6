#include "common/codec/tangent_symbols.h"

#include <algorithm>
#include <bit>

#include "common/base/check.h"
#include "common/codec/least_squares.h"
#include "common/codec/wrapping.h"

namespace strandcast {
namespace {

constexpr uint16_t kLargestSize = 4000;  // sums of nine stay small
constexpr uint16_t kEscapeSize = 64;
constexpr uint8_t kLargestLengthSize = 2;
constexpr uint32_t kSizeBits = 8;  // of a sum of sizes; larger sums are halved until they have as many

/// Which table to use and how many low bits to leave out of it, from a weighted sum of the sizes near by.
struct Size {
  uint32_t index;
  uint32_t shift;
};

Size size_of(uint32_t sum) {
  auto width = static_cast<uint32_t>(std::bit_width(sum));
  if (width < 3) return {sum, 0};
  const uint32_t shift = width > kSizeBits ? width - kSizeBits : 0;
  sum >>= shift;
  width -= shift;
  return {std::min(4 * (width - 2) + ((sum >> (width - 3)) & 3u), kSizeCount - 1), shift};
}

uint32_t magnitude(int32_t value) {
  const auto bits = static_cast<uint32_t>(value);
  return value < 0 ? 0u - bits : bits;
}

/// Writes values that are known.
struct WritePort {
  ValueWriter& writer;
  void code(int32_t& value, SymbolTable& table, uint32_t shift) {
    writer.put(fold_sign(value), table, shift);
  }
  void code_escape(std::vector<Escape>::const_iterator& next) {
    for (const int32_t step : next->step) {
      const uint32_t folded = fold_sign(step);
      const auto length = static_cast<uint32_t>(std::bit_width(folded));
      writer.put_bits(length, kEscapeLengthBits);
      writer.put_bits(folded, length);
    }
    ++next;
  }
  static constexpr uint32_t kEscapeLengthBits = 6;
};

/// Reads values and stores them.
struct ReadPort {
  ValueReader& reader;
  void code(int32_t& value, SymbolTable& table, uint32_t shift) {
    value = unfold_sign(reader.take(table, shift));
  }
  std::array<int32_t, 3> take_escape() {
    std::array<int32_t, 3> step;
    for (int32_t& one : step) {
      const uint32_t length = std::min(reader.take_bits(WritePort::kEscapeLengthBits), 32u);
      one = unfold_sign(reader.take_bits(length));
    }
    return step;
  }
};

/// Sizes around a row.
struct SizeRows {
  const uint16_t* own_then;
  const uint16_t* child_then;
  const uint16_t* parent;
  const uint16_t* grandparent;
  uint16_t* now;
  const uint8_t* length_then;
  const uint8_t* length_parent;
  uint8_t* length_now;

  SizeRows(const TangentLayout& layout, const SymbolSizes& then, SymbolSizes& sizes, uint32_t v,
           const uint16_t* zeros, const uint8_t* zero_bytes) {
    const size_t stride = layout.stride;
    const size_t begin = v * stride;
    now = sizes.across.data() + begin;
    own_then = then.across.data() + begin;
    child_then = v + 1 < layout.vertex_count ? own_then + stride : zeros;
    parent = v >= 1 ? now - stride : zeros;
    grandparent = v >= 2 ? now - 2 * stride : zeros;
    length_now = sizes.length.data() + begin;
    length_then = then.length.data() + begin;
    length_parent = v >= 1 ? length_now - stride : zero_bytes;
  }
  uint32_t near(const TangentLayout& layout, size_t place) const {
    return 2u * own_then[place] + 2u * parent[place] + grandparent[place] + child_then[place] +
           2u * now[layout.neighbour[0][place]] + now[layout.neighbour[1][place]];
  }
};

uint32_t length_table(uint32_t near, const SizeRows& rows, size_t place) {
  const uint32_t calm = near < 8 ? 0u : near < 32 ? 1u : 2u;
  return 5u * calm + rows.length_parent[place] + rows.length_then[place];
}

/// The integers of one vertex; true when it is escaped.
template <class Port>
bool code_vertex(uint32_t near, SizeRows& rows, size_t place, int32_t& first, int32_t& second,
                 int32_t& length, TangentTables& tables, Port& port) {
  SymbolTable* const firsts = tables.data();
  SymbolTable* const seconds = firsts + kSizeCount;
  SymbolTable* const lengths = seconds + kSizeCount * kFirstSizes;
  port.code(length, lengths[length_table(near, rows, place)], 0);
  if (length == kEscapedLength) {
    first = second = 0;
    rows.now[place] = kEscapeSize;
    rows.length_now[place] = kLargestLengthSize;
    return true;
  }
  const Size size = size_of(near);
  port.code(first, firsts[size.index], size.shift);
  const uint32_t first_size = std::min(magnitude(first) >> size.shift, kFirstSizes - 1);
  port.code(second, seconds[size.index * kFirstSizes + first_size], size.shift);
  const uint32_t across = std::min<uint32_t>(magnitude(first), kLargestSize) +
                          std::min<uint32_t>(magnitude(second), kLargestSize);
  rows.now[place] = static_cast<uint16_t>(std::min<uint32_t>(2 * across, kLargestSize));
  rows.length_now[place] = static_cast<uint8_t>(std::min<uint32_t>(magnitude(length), kLargestLengthSize));
  return false;
}

/// visit(row, rows around it, place) for every strand of a slice.
template <class Visit>
void for_each_symbol(const TangentLayout& layout, uint32_t slice, const SymbolSizes& then, SymbolSizes& now,
                     Visit visit) {
  const std::vector<uint16_t> zeros(layout.stride, 0);
  const std::vector<uint8_t> zero_bytes(layout.stride, 0);
  for (uint32_t v = 0; v < layout.vertex_count; ++v) {
    SizeRows rows(layout, then, now, v, zeros.data(), zero_bytes.data());
    for (size_t place = layout.slice_begin[slice]; place < layout.slice_begin[slice + 1]; ++place) {
      if (layout.strand_at[place] == kNoStrand) break;
      visit(v * static_cast<size_t>(layout.stride) + place, rows, place);
    }
  }
}

// ---- shapes ----

using ShapeTables = std::array<SymbolTable, 3 * kSizeCount>;

SymbolTable first_table() {
  // Shares fall by a quarter from symbol to symbol; a few hundred values later that is forgotten.
  std::array<int32_t, kSymbolCount> share;
  for (uint32_t k = 0; k < kSymbolCount; ++k) share[k] = k == 0 ? kProbabilityOne / 4 : share[k - 1] * 3 / 4;
  SymbolTable table;
  int32_t start = 0;
  for (uint32_t k = 0; k < kSymbolCount; ++k) {
    table.start[k] = static_cast<int16_t>(start);
    start += share[k];
  }
  return table;
}

/// Which weights serve a row: roots, first segments, the rest.
uint32_t shape_class(uint32_t v) {
  return std::min(v, kShapeClassCount - 1);
}

/// Values or edges on the way through a slice; entries of rows not yet coded are not read.
struct ShapeRows {
  const TangentLayout& layout;
  Shape shape;
  float unit_m;

  /// What is predicted at `at`: an edge or a value.
  int32_t wanted(const std::vector<int32_t>& plane, size_t at, uint32_t v) const {
    if (shape == Shape::Values || v == 0) return plane[at];
    return wrapping_difference(plane[at], plane[at - layout.stride]);
  }
  float number(const std::vector<int32_t>& plane, size_t place, uint32_t v) const {
    return static_cast<float>(wanted(plane, v * static_cast<size_t>(layout.stride) + place, v));
  }
  float rest(size_t axis, size_t place, uint32_t v) const {
    if (shape == Shape::Values) return 0.0f;
    return layout.rest_edge_m[axis][v * static_cast<size_t>(layout.stride) + place] / unit_m;
  }
  /// 0 rest  1 parent  2 grandparent  3 parent's rest; of two neighbours: 4, 7 own, 5, 8 parent, 6, 9 rest.
  std::array<float, kShapeFeatureCount> features(const std::vector<int32_t>& plane, size_t axis, size_t place,
                                                 uint32_t v) const {
    std::array<float, kShapeFeatureCount> value{};
    value[0] = rest(axis, place, v);
    if (v >= 1) value[1] = number(plane, place, v - 1);
    if (v >= 2) value[2] = number(plane, place, v - 2);
    if (v >= 1) value[3] = rest(axis, place, v - 1);
    for (size_t which = 0; which < 2; ++which) {
      const uint32_t other = layout.neighbour[which][place];
      value[4 + 3 * which] = number(plane, other, v);
      if (v >= 1) value[5 + 3 * which] = number(plane, other, v - 1);
      value[6 + 3 * which] = rest(axis, other, v);
    }
    return value;
  }
};

int32_t shape_guess(const std::array<float, kShapeFeatureCount>& value,
                    const std::array<int16_t, kShapeFeatureCount>& weights) {
  float sum = 0.0f;
  for (uint32_t k = 0; k < kShapeFeatureCount; ++k)
    sum += static_cast<float>(weights[k]) * kMotionWeight * value[k];
  constexpr float kLimit = 1e9f;
  const float low = sum > -kLimit ? sum : -kLimit;
  return static_cast<int32_t>(low < kLimit ? low : kLimit);
}

/// code(value, guess) -> the difference that was coded.
template <class Code>
void code_shape(const ShapeRows& rows, const ShapeWeights& weights, uint32_t slice,
                const Planes<int32_t>& value, Code code) {
  const TangentLayout& layout = rows.layout;
  ShapeTables tables;
  tables.fill(first_table());
  std::vector<uint16_t> size(layout.plane_size(), 0);  // of all axes
  for (uint32_t v = 0; v < layout.vertex_count; ++v) {
    for (size_t place = layout.slice_begin[slice]; place < layout.slice_begin[slice + 1]; ++place) {
      if (layout.strand_at[place] == kNoStrand) break;
      const size_t row = v * static_cast<size_t>(layout.stride);
      uint32_t near = size[row + layout.neighbour[0][place]] + size[row + layout.neighbour[1][place]];
      if (v >= 1) near += 2u * size[row - layout.stride + place];
      const Size expected = size_of(near);
      uint32_t all = 0;
      for (size_t axis = 0; axis < 3; ++axis) {
        const int32_t guess =
            shape_guess(rows.features(value[axis], axis, place, v), weights[shape_class(v)]);
        const int32_t error =
            code(axis, row + place, v, guess, tables[axis * kSizeCount + expected.index], expected.shift);
        all += std::min<uint32_t>(magnitude(error), kLargestSize);
      }
      size[row + place] = static_cast<uint16_t>(std::min<uint32_t>(all, kLargestSize));
    }
  }
}

}  // namespace

TangentTables make_first_tables() {
  TangentTables tables;
  tables.fill(first_table());
  return tables;
}

TangentTables mean_tables(std::span<const TangentTables> tables) {
  TangentTables mean;
  for (size_t i = 0; i < kTangentTableCount; ++i) {
    for (uint32_t k = 0; k < kSymbolCount; ++k) {
      int32_t sum = 0;
      for (const TangentTables& one : tables) sum += one[i].start[k];
      mean[i].start[k] = static_cast<int16_t>(sum / static_cast<int32_t>(tables.size()));
    }
  }
  return mean;
}

void SymbolSizes::reset(const TangentLayout& layout) {
  across.assign(layout.plane_size(), 0);
  length.assign(layout.plane_size(), 0);
}

void write_symbols(const TangentLayout& layout, uint32_t slice, const TangentFrame& frame,
                   const SymbolSizes& then, SymbolSizes& now, TangentTables& tables, ValueWriter& writer) {
  WritePort port{writer};
  auto escape = frame.escapes[slice].begin();
  for_each_symbol(layout, slice, then, now, [&](size_t at, SizeRows& rows, size_t place) {
    int32_t first = frame.first[at];
    int32_t second = frame.second[at];
    int32_t length = frame.length[at];
    if (code_vertex(rows.near(layout, place), rows, place, first, second, length, tables, port))
      port.code_escape(escape);
  });
}

void read_symbols(const TangentLayout& layout, uint32_t slice, TangentFrame& frame, const SymbolSizes& then,
                  SymbolSizes& now, TangentTables& tables, ValueReader& reader) {
  ReadPort port{reader};
  frame.escapes[slice].clear();
  for_each_symbol(layout, slice, then, now, [&](size_t at, SizeRows& rows, size_t place) {
    if (code_vertex(rows.near(layout, place), rows, place, frame.first[at], frame.second[at],
                    frame.length[at], tables, port) &&
        !reader.is_short())
      frame.escapes[slice].push_back({at, port.take_escape()});
  });
}

ShapeWeights fit_shape(const TangentLayout& layout, Shape shape, const Planes<int32_t>& value, float unit_m) {
  constexpr size_t kStep = 4;
  constexpr double kNoise = 0.3;  // of a unit: rounding
  const ShapeRows rows{layout, shape, unit_m};
  std::array<LeastSquares<kShapeFeatureCount>, kShapeClassCount> fits;
  for (uint32_t v = 0; v < layout.vertex_count; ++v) {
    auto& fit = fits[shape_class(v)];
    for (size_t axis = 0; axis < 3; ++axis) {
      for (size_t place = 0; place < layout.no_neighbour(); place += kStep)
        fit.add(rows.features(value[axis], axis, place, v), rows.number(value[axis], place, v));
    }
    fit.flush();
  }
  ShapeWeights weights;
  for (uint32_t c = 0; c < kShapeClassCount; ++c) weights[c] = fits[c].weights(kMotionWeight, kNoise);
  return weights;
}

void write_shape(const TangentLayout& layout, Shape shape, const ShapeWeights& weights, float unit_m,
                 uint32_t slice, const Planes<int32_t>& value, ValueWriter& writer) {
  const ShapeRows rows{layout, shape, unit_m};
  code_shape(rows, weights, slice, value,
             [&](size_t axis, size_t at, uint32_t v, int32_t guess, SymbolTable& table, uint32_t shift) {
               const int32_t error = wrapping_difference(rows.wanted(value[axis], at, v), guess);
               writer.put(fold_sign(error), table, shift);
               return error;
             });
}

void read_shape(const TangentLayout& layout, Shape shape, const ShapeWeights& weights, float unit_m,
                uint32_t slice, Planes<int32_t>& value, ValueReader& reader) {
  const ShapeRows rows{layout, shape, unit_m};
  code_shape(rows, weights, slice, value,
             [&](size_t axis, size_t at, uint32_t v, int32_t guess, SymbolTable& table, uint32_t shift) {
               const int32_t error = unfold_sign(reader.take(table, shift));
               int32_t sum = wrapping_sum(guess, error);
               if (shape == Shape::Edges && v > 0) sum = wrapping_sum(sum, value[axis][at - layout.stride]);
               value[axis][at] = sum;
               return error;
             });
}

}  // namespace strandcast

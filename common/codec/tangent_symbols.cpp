#include "common/codec/tangent_symbols.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

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

constexpr uint32_t size_class(uint32_t sum) {
  const auto width = static_cast<uint32_t>(std::bit_width(sum));
  return width < 3 ? sum : std::min(4 * (width - 2) + ((sum >> (width - 3)) & 3u), kSizeCount - 1);
}

/// Of all sums that need no shift.
constexpr auto kSizeClasses = [] {
  std::array<uint8_t, 1u << kSizeBits> classes{};
  for (uint32_t sum = 0; sum < classes.size(); ++sum) classes[sum] = static_cast<uint8_t>(size_class(sum));
  return classes;
}();

Size size_of(uint32_t sum) {
  if (sum < kSizeClasses.size()) return {kSizeClasses[sum], 0};
  const uint32_t shift = static_cast<uint32_t>(std::bit_width(sum)) - kSizeBits;
  return {kSizeClasses[sum >> shift], shift};
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
  void code_likely_zero(int32_t& value, SymbolTable& table) { code(value, table, 0); }
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
  void code_likely_zero(int32_t& value, SymbolTable& table) {
    value = unfold_sign(reader.take_likely_zero(table));
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
  const uint32_t* neighbour;
  const uint32_t* second_neighbour;

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
    neighbour = layout.neighbour[0].data();
    second_neighbour = layout.neighbour[1].data();
  }
  uint32_t near(size_t place) const {
    return 2u * own_then[place] + 2u * parent[place] + grandparent[place] + child_then[place] +
           2u * now[neighbour[place]] + now[second_neighbour[place]];
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
  port.code_likely_zero(length, lengths[length_table(near, rows, place)]);
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

/// Strands of a slice; places without one are the last.
size_t strands_in(const TangentLayout& layout, uint32_t slice) {
  size_t end = layout.slice_begin[slice + 1];
  while (end > layout.slice_begin[slice] && layout.strand_at[end - 1] == kNoStrand) --end;
  return end - layout.slice_begin[slice];
}

/// What goes through the integers of a slice row by row; coder(at, rows around it, place) does one vertex.
template <class Coder>
class SymbolWalk {
 public:
  SymbolWalk(const TangentLayout& layout, uint32_t slice, const SymbolSizes& then, SymbolSizes& now,
             Coder coder)
      : layout_(layout),
        begin_(layout.slice_begin[slice]),
        count_(strands_in(layout, slice)),
        zeros_(layout.stride, 0),
        zero_bytes_(layout.stride, 0),
        then_(then),
        now_(now),
        rows_(layout, then, now, 0, zeros_.data(), zero_bytes_.data()),
        coder_(std::move(coder)) {}

  size_t strand_count() const { return count_; }
  void begin_row(uint32_t v) {
    row_ = v * static_cast<size_t>(layout_.stride);
    rows_ = SizeRows(layout_, then_, now_, v, zeros_.data(), zero_bytes_.data());
  }
  /// The strand at position i of the slice.
  void code(size_t i) { coder_(row_ + begin_ + i, rows_, begin_ + i); }

 private:
  const TangentLayout& layout_;
  size_t begin_;
  size_t count_;
  std::vector<uint16_t> zeros_;
  std::vector<uint8_t> zero_bytes_;
  const SymbolSizes& then_;
  SymbolSizes& now_;
  size_t row_ = 0;
  SizeRows rows_;
  Coder coder_;
};

// ---- shapes ----

constexpr uint32_t kShapeTableCount = 2 * kSizeCount;  // free axes; those that the length tells
using ShapeTables = std::array<SymbolTable, kShapeTableCount>;

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

using ShapeFeatures = std::array<float, kShapeFeatureCount>;
using Vector = std::array<float, 3>;

float dot(const Vector& a, const Vector& b) {
  return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2];
}

/// `x` turned by the smallest rotation that takes the direction of `from` to that of `to`; zero where there
/// is none.
Vector turned(const Vector& x, const Vector& from, const Vector& to) {
  constexpr float kTiny = 1e-6f;
  constexpr float kLargest = 1e9f;
  constexpr float kLeastSum = 0.05f;  // of one and the cosine
  const float from_squared = dot(from, from);
  const float to_squared = dot(to, to);
  if (!(from_squared > kTiny && to_squared > kTiny && from_squared < kLargest && to_squared < kLargest))
    return {};
  const float from_scale = 1.0f / std::sqrt(from_squared);
  const float to_scale = 1.0f / std::sqrt(to_squared);
  Vector a;
  Vector b;
  Vector sum;
  for (size_t i = 0; i < 3; ++i) {
    a[i] = from[i] * from_scale;
    b[i] = to[i] * to_scale;
    sum[i] = a[i] + b[i];
  }
  const float one_and_cosine = 1.0f + dot(a, b);
  if (!(one_and_cosine > kLeastSum)) return {};
  const float along_sum = dot(x, sum) / one_and_cosine;
  const float along_from = 2.0f * dot(x, a);
  Vector result;
  for (size_t i = 0; i < 3; ++i) result[i] = (x[i] - along_sum * sum[i]) + along_from * b[i];
  return result;
}

/// Roots and edges on the way through a slice; entries of rows not yet coded are not read.
struct ShapeRows {
  const TangentLayout& layout;
  float unit_m;

  /// What is predicted at `at`: an edge, or the position of a root.
  int32_t wanted(const std::vector<int32_t>& plane, size_t at, uint32_t v) const {
    if (v == 0) return plane[at];
    return wrapping_difference(plane[at], plane[at - layout.stride]);
  }
  float number(const std::vector<int32_t>& plane, size_t place, uint32_t v) const {
    return static_cast<float>(wanted(plane, v * static_cast<size_t>(layout.stride) + place, v));
  }
  float rest(size_t axis, size_t place, uint32_t v) const {
    return layout.rest_edge_m[axis][v * static_cast<size_t>(layout.stride) + place] / unit_m;
  }
  Vector edge_at(const Planes<int32_t>& value, size_t place, uint32_t v) const {
    return {number(value[0], place, v), number(value[1], place, v), number(value[2], place, v)};
  }
  Vector rest_at(size_t place, uint32_t v) const {
    return {rest(0, place, v), rest(1, place, v), rest(2, place, v)};
  }
  /// The rest edge at `place`, turned as the edge of vertex `by_v` at `by_place` has turned from its rest.
  Vector turned_rest(const Planes<int32_t>& value, size_t place, uint32_t v, size_t by_place,
                     uint32_t by_v) const {
    return turned(rest_at(place, v), rest_at(by_place, by_v), edge_at(value, by_place, by_v));
  }
  /// Of each axis: 0 rest  1 parent  2 grandparent  3 parent's rest; of two neighbours: 4, 7 own, 5, 8
  /// parent, 6, 9 rest; own rest turned like 10 the parent 11, 12 the neighbours.
  std::array<ShapeFeatures, 3> features(const Planes<int32_t>& value, size_t place, uint32_t v) const {
    std::array<Vector, 3> turned_by{};
    if (v >= 1) {
      if (v >= 2) turned_by[0] = turned_rest(value, place, v, place, v - 1);
      for (size_t which = 0; which < 2; ++which)
        turned_by[1 + which] = turned_rest(value, place, v, layout.neighbour[which][place], v);
    }
    std::array<ShapeFeatures, 3> all{};
    for (size_t axis = 0; axis < 3; ++axis) {
      ShapeFeatures& one = all[axis];
      const std::vector<int32_t>& plane = value[axis];
      one[0] = rest(axis, place, v);
      if (v >= 1) one[1] = number(plane, place, v - 1);
      if (v >= 2) one[2] = number(plane, place, v - 2);
      if (v >= 1) one[3] = rest(axis, place, v - 1);
      for (size_t which = 0; which < 2; ++which) {
        const uint32_t other = layout.neighbour[which][place];
        one[4 + 3 * which] = number(plane, other, v);
        if (v >= 1) one[5 + 3 * which] = number(plane, other, v - 1);
        one[6 + 3 * which] = rest(axis, other, v);
      }
      for (size_t k = 0; k < 3; ++k) one[10 + k] = turned_by[k][axis];
    }
    return all;
  }
};

float shape_guess(const ShapeFeatures& value, const std::array<int16_t, kShapeFeatureCount>& weights) {
  float sum = 0.0f;
  for (uint32_t k = 0; k < kShapeFeatureCount; ++k)
    sum += static_cast<float>(weights[k]) * kMotionWeight * value[k];
  constexpr float kLimit = 1e9f;
  const float low = sum > -kLimit ? sum : -kLimit;
  return low < kLimit ? low : kLimit;
}

/// What is expected of one vertex, axis after axis.
struct ShapeGuess {
  std::array<float, 3> edge;
  float squared_length = 0.0f;  // 0: not known
  size_t last_axis = 2;         // coded after the others, when its size follows from the length

  /// Brings the guess to a known length.
  void fit_length(float length) {
    const float squared = (edge[0] * edge[0] + edge[1] * edge[1]) + edge[2] * edge[2];
    if (!(length > 0.0f && length < kLongest && squared > kShortest)) return;
    const float scale = length / std::sqrt(squared);
    for (float& value : edge) value *= scale;
    squared_length = length * length;
    last_axis = std::abs(edge[0]) > std::abs(edge[1]) ? 0 : 1;
    if (std::abs(edge[2]) > std::abs(edge[last_axis])) last_axis = 2;
  }
  /// Of the last axis, with the others known.
  float last(int32_t first, int32_t second) const {
    const auto a = static_cast<float>(first);
    const auto b = static_cast<float>(second);
    const float left = (squared_length - a * a) - b * b;
    const float guess = edge[last_axis];
    if (!(left > kLeastLeft * (guess * guess))) return guess;
    return guess < 0.0f ? -std::sqrt(left) : std::sqrt(left);
  }

  static constexpr float kShortest = 1e-6f;
  static constexpr float kLongest = 1e6f;
  static constexpr float kLeastLeft = 0.25f;
};

/// To the nearest whole number, halves away from zero.
int32_t rounded_guess(float guess) {
  return static_cast<int32_t>(guess < 0.0f ? guess - 0.5f : guess + 0.5f);
}

/// code(axis, at, v, guess, table, shift) -> the difference that was coded.
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
      ShapeGuess guess;
      const auto features = rows.features(value, place, v);
      for (size_t axis = 0; axis < 3; ++axis)
        guess.edge[axis] = shape_guess(features[axis], weights[shape_class(v)]);
      if (v >= 1) guess.fit_length(layout.rest_length_m[row + place] / rows.unit_m);
      uint32_t all = 0;
      const auto code_axis = [&](size_t axis, float wanted, SymbolTable* of) {
        const int32_t error =
            code(axis, row + place, v, rounded_guess(wanted), of[expected.index], expected.shift);
        all += std::min<uint32_t>(magnitude(error), kLargestSize);
        return rows.wanted(value[axis], row + place, v);
      };
      const size_t first_axis = guess.last_axis == 0 ? 1 : 0;
      const size_t second_axis = 3 - guess.last_axis - first_axis;
      const int32_t first = code_axis(first_axis, guess.edge[first_axis], tables.data());
      const int32_t second = code_axis(second_axis, guess.edge[second_axis], tables.data());
      if (guess.squared_length > 0.0f)
        code_axis(guess.last_axis, guess.last(first, second), tables.data() + kSizeCount);
      else
        code_axis(guess.last_axis, guess.edge[guess.last_axis], tables.data());
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
  SymbolWalk walk(layout, slice, then, now, [&](size_t at, SizeRows& rows, size_t place) {
    int32_t first = frame.first[at];
    int32_t second = frame.second[at];
    int32_t length = frame.length[at];
    if (code_vertex(rows.near(place), rows, place, first, second, length, tables, port))
      port.code_escape(escape);
  });
  for (uint32_t v = 0; v < layout.vertex_count; ++v) {
    walk.begin_row(v);
    for (size_t i = 0; i < walk.strand_count(); ++i) walk.code(i);
  }
}

void read_symbols(const TangentLayout& layout, const SymbolSizes& then, TangentFrame& frame, SymbolSizes& now,
                  std::span<SliceSymbols> slices) {
  const auto make_walk = [&](SliceSymbols& symbols) {
    frame.escapes[symbols.slice].clear();
    return SymbolWalk(layout, symbols.slice, then, now,
                      [&, port = ReadPort{symbols.reader}](size_t at, SizeRows& rows, size_t place) mutable {
                        if (code_vertex(rows.near(place), rows, place, frame.first[at], frame.second[at],
                                        frame.length[at], symbols.tables, port) &&
                            !symbols.reader.is_short())
                          frame.escapes[symbols.slice].push_back({at, port.take_escape()});
                      });
  };
  CHECK(!slices.empty() && slices.size() <= kSlicesAtOnce);
  auto one = make_walk(slices.front());
  auto other = make_walk(slices.back());
  const size_t other_count = slices.size() == 1 ? 0 : other.strand_count();
  const size_t common = std::min(one.strand_count(), other_count);
  for (uint32_t v = 0; v < layout.vertex_count; ++v) {
    one.begin_row(v);
    other.begin_row(v);
    for (size_t i = 0; i < common; ++i) {
      one.code(i);
      other.code(i);
    }
    for (size_t i = common; i < one.strand_count(); ++i) one.code(i);
    for (size_t i = common; i < other_count; ++i) other.code(i);
  }
}

ShapeWeights fit_shape(const TangentLayout& layout, const Planes<int32_t>& value, float unit_m) {
  constexpr size_t kStep = 4;
  constexpr double kNoise = 0.3;  // of a unit: rounding
  const ShapeRows rows{layout, unit_m};
  std::array<LeastSquares<kShapeFeatureCount>, kShapeClassCount> fits;
  for (uint32_t v = 0; v < layout.vertex_count; ++v) {
    auto& fit = fits[shape_class(v)];
    for (size_t place = 0; place < layout.no_neighbour(); place += kStep) {
      const auto features = rows.features(value, place, v);
      for (size_t axis = 0; axis < 3; ++axis) fit.add(features[axis], rows.number(value[axis], place, v));
    }
    fit.flush();
  }
  ShapeWeights weights;
  for (uint32_t c = 0; c < kShapeClassCount; ++c) weights[c] = fits[c].weights(kMotionWeight, kNoise);
  return weights;
}

void write_shape(const TangentLayout& layout, const ShapeWeights& weights, float unit_m, uint32_t slice,
                 const Planes<int32_t>& value, ValueWriter& writer) {
  const ShapeRows rows{layout, unit_m};
  code_shape(rows, weights, slice, value,
             [&](size_t axis, size_t at, uint32_t v, int32_t guess, SymbolTable& table, uint32_t shift) {
               const int32_t error = wrapping_difference(rows.wanted(value[axis], at, v), guess);
               writer.put(fold_sign(error), table, shift);
               return error;
             });
}

void read_shape(const TangentLayout& layout, const ShapeWeights& weights, float unit_m, uint32_t slice,
                Planes<int32_t>& value, ValueReader& reader) {
  const ShapeRows rows{layout, unit_m};
  code_shape(rows, weights, slice, value,
             [&](size_t axis, size_t at, uint32_t v, int32_t guess, SymbolTable& table, uint32_t shift) {
               const int32_t error = unfold_sign(reader.take(table, shift));
               int32_t sum = wrapping_sum(guess, error);
               if (v > 0) sum = wrapping_sum(sum, value[axis][at - layout.stride]);
               value[axis][at] = sum;
               return error;
             });
}

}  // namespace strandcast

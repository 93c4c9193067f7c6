#include "common/strands/tangent/symbols.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "common/base/check.h"

namespace strandcast::tangent {
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

  SizeRows(const Layout& layout, const SymbolSizes& then, SymbolSizes& sizes, uint32_t v,
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
                 int32_t& length, Tables& tables, Port& port) {
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
size_t strands_in(const Layout& layout, uint32_t slice) {
  size_t end = layout.slice_begin[slice + 1];
  while (end > layout.slice_begin[slice] && layout.strand_at[end - 1] == kNoStrand) --end;
  return end - layout.slice_begin[slice];
}

/// What goes through the integers of a slice row by row; coder(at, rows around it, place) does one vertex.
template <class Coder>
class SymbolWalk {
 public:
  SymbolWalk(const Layout& layout, uint32_t slice, const SymbolSizes& then, SymbolSizes& now, Coder coder)
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
  const Layout& layout_;
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
      left = std::min(magnitude(difference), kLargest);
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

void write_symbols(const Layout& layout, uint32_t slice, const Codes& codes, const SymbolSizes& then,
                   SymbolSizes& now, Tables& tables, ValueWriter& writer) {
  WritePort port{writer};
  auto escape = codes.escapes[slice].begin();
  SymbolWalk walk(layout, slice, then, now, [&](size_t at, SizeRows& rows, size_t place) {
    int32_t first = codes.first[at];
    int32_t second = codes.second[at];
    int32_t length = codes.length[at];
    if (code_vertex(rows.near(place), rows, place, first, second, length, tables, port))
      port.code_escape(escape);
  });
  for (uint32_t v = 0; v < layout.vertex_count; ++v) {
    walk.begin_row(v);
    for (size_t i = 0; i < walk.strand_count(); ++i) walk.code(i);
  }
}

void read_symbols(const Layout& layout, const SymbolSizes& then, Codes& codes, SymbolSizes& now,
                  std::span<SliceSymbols> slices) {
  const auto make_walk = [&](SliceSymbols& symbols) {
    codes.escapes[symbols.slice].clear();
    return SymbolWalk(layout, symbols.slice, then, now,
                      [&, port = ReadPort{symbols.reader}](size_t at, SizeRows& rows, size_t place) mutable {
                        if (code_vertex(rows.near(place), rows, place, codes.first[at], codes.second[at],
                                        codes.length[at], symbols.tables, port) &&
                            !symbols.reader.is_short())
                          codes.escapes[symbols.slice].push_back({at, port.take_escape()});
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

}  // namespace strandcast::tangent

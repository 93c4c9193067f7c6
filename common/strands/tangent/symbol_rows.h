// Chooses the tables that code a vertex's integers by the sizes of nearby integers. Shared by symbols.h and
// sparse_symbols.h. Private to common/strands/tangent.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <vector>

#include "common/strands/tangent/symbols.h"

namespace strandcast::tangent {

inline constexpr uint32_t kLargestSize = 4000;  // sums of nine stay small
inline constexpr uint32_t kEscapeSize = 64;
inline constexpr uint32_t kLargestLengthSize = 2;
inline constexpr uint32_t kSizeBits = 8;  // of a sum of sizes; larger sums are halved until they have as many
inline constexpr uint32_t kEscapeLengthBits = 6;
inline constexpr uint32_t kLengthSums = 5;  // of what two lengths near by can be together

constexpr uint32_t size_class(uint32_t sum) {
  const auto width = static_cast<uint32_t>(std::bit_width(sum));
  return width < 3 ? sum : std::min(4 * (width - 2) + ((sum >> (width - 3)) & 3u), kSizeCount - 1);
}

/// Lookup from a sum of at most kSizeBits bits to its table class: for both coordinates, and the first class
/// for the length.
template <class Class>
constexpr auto classes_of(Class class_of) {
  std::array<uint8_t, 1u << kSizeBits> classes{};
  for (uint32_t sum = 0; sum < classes.size(); ++sum) classes[sum] = static_cast<uint8_t>(class_of(sum));
  return classes;
}
inline constexpr auto kSizeClasses = classes_of(size_class);
inline constexpr auto kLengthClasses = classes_of([](uint32_t sum) {
  return kLengthSums * (sum < 8 ? 0u : sum < 32 ? 1u : 2u);
});

/// Returns the magnitude of a folded integer (fold_sign).
STRANDCAST_LANES uint32_t magnitude(uint32_t folded) {
  return (folded >> 1) + (folded & 1u);
}

/// Table class for a sum of nearby magnitudes, and the number of low bits that are coded plainly. Most sums
/// are so small that this number is 0.
template <bool has_shift>
struct Size {
  uint32_t size;
  uint32_t length;
  uint32_t shift = 0;

  STRANDCAST_LANES explicit Size(uint32_t near) {
    if constexpr (has_shift) shift = static_cast<uint32_t>(std::bit_width(near)) - kSizeBits;
    size = kSizeClasses[near >> shift];
    length = kLengthClasses[near >> shift];
  }
  /// Returns the table of the second coordinate, given the first.
  STRANDCAST_LANES uint32_t second_table(uint32_t first) const {
    const uint32_t first_size = magnitude(first) >> shift;
    return size * kFirstSizes + (first_size < kFirstSizes ? first_size : kFirstSizes - 1);
  }
};

/// Calls work(size) with the size class of a sum.
template <class Work>
STRANDCAST_LANES void with_size(uint32_t near, Work work) {
  if (near < kSizeClasses.size()) [[likely]]
    work(Size<false>(near));
  else
    work(Size<true>(near));
}

/// Returns twice the magnitude of a folded integer, clamped.
STRANDCAST_LANES uint32_t doubled(uint32_t folded) {
  constexpr uint32_t kLimit = 2 * kLargestSize;
  return ((folded < kLimit ? folded : kLimit) + 1u) & ~1u;
}
STRANDCAST_LANES uint16_t across_size(uint32_t first, uint32_t second) {
  const uint32_t sum = doubled(first) + doubled(second);
  return static_cast<uint16_t>(sum < kLargestSize ? sum : kLargestSize);
}
STRANDCAST_LANES uint8_t length_size(uint32_t length) {
  constexpr uint32_t kLimit = 2 * kLargestLengthSize;
  return static_cast<uint8_t>(((length < kLimit ? length : kLimit) + 1u) >> 1);
}

/// Tables of a slice by purpose.
struct TableSet {
  SymbolTable* first;
  SymbolTable* second;
  SymbolTable* length;

  explicit TableSet(Tables& tables)
      : first(tables.data()), second(first + kSizeCount), length(second + kSizeCount * kFirstSizes) {}
};

/// A row and the sizes around it. Holds only pointers, so that it fits into registers.
struct SymbolRow {
  const uint16_t* known;        // sum of sizes that do not wait for others of the row
  const uint8_t* known_length;  // likewise of lengths
  const uint32_t* neighbour;
  const uint32_t* second_neighbour;
  uint16_t* across;  // sizes of the row, to be filled
  uint8_t* length;

  STRANDCAST_LANES uint32_t near(size_t place) const {
    return known[place] + 2u * across[neighbour[place]] + across[second_neighbour[place]];
  }
};

/// Sizes of the preceding frame and of this one.
class SizeRows {
 public:
  SizeRows(const Layout& layout, const Neighbours& beside, const SymbolSizes& then, SymbolSizes& now)
      : layout_(layout),
        beside_(beside),
        then_(then),
        now_(now),
        zeros_(layout.stride, 0),
        zero_bytes_(layout.stride, 0),
        known_(layout.stride, 0),
        known_length_(layout.stride, 0) {}

  /// Begins row v: sums the known sizes of `count` places from `begin` on and sets the sizes of their lengths
  /// to 0.
  STRANDCAST_LANES SymbolRow begin_row(uint32_t v, size_t begin, size_t count) {
    const size_t stride = layout_.stride;
    uint16_t* const across = now_.across.data() + v * stride;
    uint8_t* const length = now_.length.data() + v * stride;
    const uint16_t* const own = then_.across.data() + v * stride + begin;
    const uint16_t* const child = v + 1 < layout_.vertex_count ? own + stride : zeros_.data() + begin;
    const uint16_t* const parent = (v >= 1 ? across - stride : zeros_.data()) + begin;
    const uint16_t* const grandparent = (v >= 2 ? across - 2 * stride : zeros_.data()) + begin;
    const uint8_t* const own_length = then_.length.data() + v * stride + begin;
    const uint8_t* const parent_length = (v >= 1 ? length - stride : zero_bytes_.data()) + begin;
    uint16_t* __restrict sum = known_.data() + begin;
    for (size_t i = 0; i < count; ++i)
      sum[i] = static_cast<uint16_t>(2u * (uint32_t{own[i]} + parent[i]) + grandparent[i] + child[i]);
    uint8_t* __restrict length_sum = known_length_.data() + begin;
    for (size_t i = 0; i < count; ++i) length_sum[i] = static_cast<uint8_t>(own_length[i] + parent_length[i]);
    std::memset(length + begin, 0, count);
    return {known_.data(), known_length_.data(), beside_[0].data(), beside_[1].data(), across, length};
  }

 private:
  const Layout& layout_;
  const Neighbours& beside_;
  const SymbolSizes& then_;
  SymbolSizes& now_;
  std::vector<uint16_t> zeros_;
  std::vector<uint8_t> zero_bytes_;
  std::vector<uint16_t> known_;
  std::vector<uint8_t> known_length_;
};

inline void write_escape(const Escape& escape, ValueWriter& writer) {
  for (const int32_t step : escape.step) {
    const uint32_t folded = fold_sign(step);
    const auto length = static_cast<uint32_t>(std::bit_width(folded));
    writer.put_bits(length, kEscapeLengthBits);
    writer.put_bits(folded, length);
  }
}

inline std::array<int32_t, 3> read_escape(ValueReader& reader) {
  std::array<int32_t, 3> step;
  for (int32_t& one : step) {
    const uint32_t length = std::min(reader.take_bits(kEscapeLengthBits), 32u);
    one = unfold_sign(reader.take_bits(length));
  }
  return step;
}

inline SymbolTable first_table() {
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

}  // namespace strandcast::tangent

// Entropy coding of signed integers whose probable size is known beforehand: 16-symbol tables that follow the
// data, range asymmetric numeral systems (J. Duda 2013, arXiv 1311.2540) for the symbols, plain bits for the
// rest. Integers only, so the same bytes everywhere. Header only for speed; one object per thread and slice.
// Layout in proto/WIRE.md.
#pragma once

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "common/base/result.h"

namespace strandcast {

inline constexpr uint32_t kSymbolCount = 16;
inline constexpr uint32_t kProbabilityBits = 15;
inline constexpr int32_t kProbabilityOne = 1 << kProbabilityBits;
inline constexpr uint32_t kRansLow = 1u << 16;  // the state stays in [kRansLow, 2^32)

/// Where each symbol's share of [0, kProbabilityOne) begins; strictly increasing from 0.
struct alignas(16) SymbolTable {
  std::array<int16_t, kSymbolCount> start;

  int32_t share(uint32_t symbol) const {
    return (symbol + 1 < kSymbolCount ? start[symbol + 1] : kProbabilityOne) - start[symbol];
  }
  /// Moves the shares 1/2^rate of the way to where only `symbol` occurs.
  void learn(uint32_t symbol);

  bool operator==(const SymbolTable&) const = default;
};

inline constexpr int32_t kLeastShare = 4;
inline constexpr int kLearnShift = 7;

/// Targets of SymbolTable::learn, one row for each symbol.
alignas(16) inline constexpr auto kLearnTargets = [] {
  std::array<std::array<int16_t, kSymbolCount>, kSymbolCount> rows{};
  for (uint32_t symbol = 0; symbol < kSymbolCount; ++symbol) {
    for (uint32_t k = 0; k < kSymbolCount; ++k) {
      const auto below = static_cast<int32_t>(k) * kLeastShare;
      const auto above = kProbabilityOne - static_cast<int32_t>(kSymbolCount - k) * kLeastShare;
      rows[symbol][k] = static_cast<int16_t>(k <= symbol ? below : above);
    }
  }
  return rows;
}();

/// The last symbol whose share begins at or before `place`.
inline uint32_t find_symbol(const SymbolTable& table, int32_t place) {
#if defined(__SSE2__)
  const __m128i wanted = _mm_set1_epi16(static_cast<int16_t>(place));
  const auto* const start = reinterpret_cast<const __m128i*>(table.start.data());
  const __m128i low = _mm_cmpgt_epi16(_mm_load_si128(start), wanted);
  const __m128i high = _mm_cmpgt_epi16(_mm_load_si128(start + 1), wanted);
  const auto beyond = static_cast<uint32_t>(_mm_movemask_epi8(_mm_packs_epi16(low, high)));
  return static_cast<uint32_t>(std::countr_zero(beyond | 1u << kSymbolCount)) - 1u;
#else
  uint32_t symbol = 0;
  for (uint32_t k = 1; k < kSymbolCount; ++k) symbol += table.start[k] <= place ? 1u : 0u;
  return symbol;
#endif
}

inline void SymbolTable::learn(uint32_t symbol) {
  const auto& target = kLearnTargets[symbol];
#if defined(__SSE2__)
  auto* const at = reinterpret_cast<__m128i*>(start.data());
  const auto* const to = reinterpret_cast<const __m128i*>(target.data());
  for (int half = 0; half < 2; ++half) {
    const __m128i now = _mm_load_si128(at + half);
    const __m128i step = _mm_srai_epi16(_mm_sub_epi16(_mm_load_si128(to + half), now), kLearnShift);
    _mm_store_si128(at + half, _mm_add_epi16(now, step));
  }
#else
  for (uint32_t k = 0; k < kSymbolCount; ++k)
    start[k] = static_cast<int16_t>(start[k] + ((target[k] - start[k]) >> kLearnShift));
#endif
}

// A folded value u below kFirstTail is its own symbol; the symbols above stand for ranges of growing size,
// the last one for everything beyond.
inline constexpr uint32_t kFirstTail = 12;
inline constexpr std::array<uint32_t, 3> kTailBits = {1, 2, 4};
inline constexpr std::array<uint32_t, 4> kTailBegin = {12, 14, 18, 34};
inline constexpr uint32_t kLengthBits = 5;  // of an escaped value

/// 0, 1, -1, 2, -2, ... become 0, 1, 2, 3, 4, ...; one to one for all 32-bit values.
inline uint32_t fold_sign(int32_t value) {
  const uint32_t negated = 0u - static_cast<uint32_t>(value);
  return (negated << 1) ^ (0u - (negated >> 31));
}
inline int32_t unfold_sign(uint32_t folded) {
  const uint32_t negated = (folded >> 1) ^ (0u - (folded & 1u));
  return static_cast<int32_t>(0u - negated);
}

/// Collects one slice.
class ValueWriter {
 public:
  /// The value's lowest `shift` bits are written plainly, the rest with `table`, which learns.
  void put(uint32_t folded, SymbolTable& table, uint32_t shift) {
    const uint32_t value = folded >> shift;
    uint32_t symbol = value;
    if (value >= kFirstTail) {
      symbol = kFirstTail;
      while (symbol + 1 < kSymbolCount && value >= kTailBegin[symbol + 1 - kFirstTail]) ++symbol;
      put_tail(value, symbol);
    }
    steps_.push_back(
        {static_cast<uint16_t>(table.start[symbol]), static_cast<uint16_t>(table.share(symbol))});
    table.learn(symbol);
    if (shift != 0) put_bits(folded & ((1u << shift) - 1u), shift);
  }
  void put_bits(uint32_t value, uint32_t count) {
    pending_ |= static_cast<uint64_t>(value) << pending_count_;
    pending_count_ += count;
    while (pending_count_ >= 8) {
      bits_.push_back(static_cast<std::byte>(pending_));
      pending_ >>= 8;
      pending_count_ -= 8;
    }
  }
  /// Appends two u32 lengths, the symbols' words and the plain bits, and starts anew.
  void finish(std::vector<std::byte>& destination);
  void reserve(size_t value_count) { steps_.reserve(value_count); }

 private:
  struct Step {
    uint16_t start;
    uint16_t share;
  };
  void put_tail(uint32_t value, uint32_t symbol) {
    const uint32_t beyond = value - kTailBegin[symbol - kFirstTail];
    if (symbol + 1 < kSymbolCount) return put_bits(beyond, kTailBits[symbol - kFirstTail]);
    const auto length = static_cast<uint32_t>(std::bit_width(beyond + 1)) - 1;
    put_bits(length, kLengthBits);
    put_bits(beyond + 1 - (1u << length), length);
  }

  std::vector<Step> steps_;
  std::vector<uint16_t> words_;
  std::vector<std::byte> bits_;
  uint64_t pending_ = 0;
  uint32_t pending_count_ = 0;
};

/// Reads one slice from untrusted bytes: any bytes give some values; ask is_spent() afterwards.
class ValueReader {
 public:
  /// Takes the slice from the front of `source` and gives the bytes behind it.
  Result<std::span<const std::byte>> open(std::span<const std::byte> source);

  uint32_t take(SymbolTable& table, uint32_t shift) {
    const auto place = static_cast<int32_t>(state_ & (kProbabilityOne - 1));
    const uint32_t symbol = find_symbol(table, place);
    pass(table, symbol, place);
    const uint32_t value = symbol < kFirstTail ? symbol : take_tail(symbol);
    return shift == 0 ? value : (value << shift) | take_bits(shift);
  }
  /// take(table, 0) where 0 is by far the most frequent: a guess of the processor's, instead of a search
  /// that it must wait for.
  uint32_t take_likely_zero(SymbolTable& table) {
    const auto place = static_cast<int32_t>(state_ & (kProbabilityOne - 1));
    if (place >= table.start[1]) [[unlikely]]
      return take(table, 0);
    pass(table, 0, place);
    return 0;
  }
  uint32_t take_bits(uint32_t count);
  /// True when exactly the bytes of the slice were needed.
  bool is_spent() const;
  /// True when more was asked for than there is: everything since then is made up.
  bool is_short() const { return is_short_; }

 private:
  uint32_t next_word() {
    if (words_.size() < sizeof(uint16_t)) {
      is_short_ = true;
      return 0;
    }
    uint16_t word;
    std::memcpy(&word, words_.data(), sizeof(word));
    words_ = words_.subspan(sizeof(word));
    return word;
  }
  uint32_t take_tail(uint32_t symbol);
  /// Goes on to the state before `symbol`.
  void pass(SymbolTable& table, uint32_t symbol, int32_t place) {
    state_ = static_cast<uint32_t>(table.share(symbol)) * (state_ >> kProbabilityBits) +
             static_cast<uint32_t>(place - table.start[symbol]);
    if (state_ < kRansLow) state_ = (state_ << 16) | next_word();
    table.learn(symbol);
  }

  std::span<const std::byte> words_;
  std::span<const std::byte> bits_;
  uint64_t pending_ = 0;
  uint32_t pending_count_ = 0;
  uint32_t state_ = kRansLow;
  bool is_short_ = false;
};

}  // namespace strandcast

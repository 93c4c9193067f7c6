// Entropy coding of signed integers with an expected size. Adaptive tables of 16 symbols code the high bits
// by range asymmetric numeral systems (J. Duda 2013, arXiv 1311.2540); the low bits are plain. Integers only,
// so bytes are the same everywhere. Header only for speed; one object per thread and slice. Layout in
// proto/WIRE.md.
#pragma once

#if defined(__SSE2__)
#include <emmintrin.h>
#elif defined(__wasm_simd128__)
#include <wasm_simd128.h>
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
#include "common/simd/lanes.h"

namespace strandcast {

inline constexpr uint32_t kSymbolCount = 16;
inline constexpr uint32_t kProbabilityBits = 15;
inline constexpr int32_t kProbabilityOne = 1 << kProbabilityBits;
inline constexpr uint32_t kRansLow = 1u << 16;  // the state stays in [kRansLow, 2^32)

/// Start of each symbol's share of [0, kProbabilityOne); strictly increasing from 0.
struct alignas(32) SymbolTable {
  std::array<int16_t, kSymbolCount> start;

  STRANDCAST_LANES int32_t share(uint32_t symbol) const {
    // Behind the last symbol comes the first, which begins at 0, so at kProbabilityOne when wrapped around.
    return (start[(symbol + 1) % kSymbolCount] - start[symbol]) & (kProbabilityOne - 1);
  }
  /// Moves the shares by 1/2^rate towards a table where only `symbol` occurs.
  STRANDCAST_LANES void learn(uint32_t symbol);

  bool operator==(const SymbolTable&) const = default;
};

inline constexpr int32_t kLeastShare = 4;
inline constexpr int kLearnShift = 7;

/// Targets of SymbolTable::learn, one row for each symbol.
alignas(32) inline constexpr auto kLearnTargets = [] {
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

/// Returns the last symbol whose share begins at or before `place`.
STRANDCAST_LANES uint32_t find_symbol(const SymbolTable& table, int32_t place) {
#if defined(__SSE2__)
  const __m128i wanted = _mm_set1_epi16(static_cast<int16_t>(place));
  const auto* const start = reinterpret_cast<const __m128i*>(table.start.data());
  const __m128i low = _mm_cmpgt_epi16(_mm_load_si128(start), wanted);
  const __m128i high = _mm_cmpgt_epi16(_mm_load_si128(start + 1), wanted);
  const auto beyond = static_cast<uint32_t>(_mm_movemask_epi8(_mm_packs_epi16(low, high)));
  return static_cast<uint32_t>(std::countr_zero(beyond | 1u << kSymbolCount)) - 1u;
#elif defined(__wasm_simd128__)
  const v128_t wanted = wasm_i16x8_splat(static_cast<int16_t>(place));
  const v128_t low = wasm_i16x8_gt(wasm_v128_load(table.start.data()), wanted);
  const v128_t high = wasm_i16x8_gt(wasm_v128_load(table.start.data() + kSymbolCount / 2), wanted);
  const auto beyond = static_cast<uint32_t>(wasm_i8x16_bitmask(wasm_i8x16_narrow_i16x8(low, high)));
  return static_cast<uint32_t>(std::countr_zero(beyond | 1u << kSymbolCount)) - 1u;
#else
  uint32_t symbol = 0;
  for (uint32_t k = 1; k < kSymbolCount; ++k) symbol += table.start[k] <= place ? 1u : 0u;
  return symbol;
#endif
}

STRANDCAST_LANES void SymbolTable::learn(uint32_t symbol) {
  using Starts = int16_t __attribute__((vector_size(sizeof(start))));
  Starts now;
  Starts target;
  std::memcpy(&now, start.data(), sizeof now);
  std::memcpy(&target, kLearnTargets[symbol].data(), sizeof target);
  now += (target - now) >> kLearnShift;
  std::memcpy(start.data(), &now, sizeof now);
}

// A folded value u below kFirstTail is its own symbol; the symbols above stand for ranges of growing size,
// the last one for everything beyond.
inline constexpr uint32_t kFirstTail = 12;
inline constexpr std::array<uint32_t, 3> kTailBits = {1, 2, 4};
inline constexpr std::array<uint32_t, 4> kTailBegin = {12, 14, 18, 34};
inline constexpr uint32_t kLengthBits = 5;  // of an escaped value

/// Maps 0, 1, -1, 2, -2, ... to 0, 1, 2, 3, 4, ...; one to one for all 32-bit values.
constexpr uint32_t fold_sign(int32_t value) {
  const uint32_t negated = 0u - static_cast<uint32_t>(value);
  return (negated << 1) ^ (0u - (negated >> 31));
}
constexpr int32_t unfold_sign(uint32_t folded) {
  const uint32_t negated = (folded >> 1) ^ (0u - (folded & 1u));
  return static_cast<int32_t>(0u - negated);
}

/// Begin and end of a symbol's share.
struct SymbolStep {
  uint16_t begin;
  uint16_t end;
};

/// Collects the symbols of one slice.
class ValueWriter {
 public:
  /// Writes the value's lowest `shift` bits plainly and the rest with `table`, which adapts.
  void put(uint32_t folded, SymbolTable& table, uint32_t shift) {
    SymbolStep* next = begin_run(1);
    put(folded, table, shift, next);
    end_run(next);
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

  /// Makes room for `value_count` values. Pass the pointer to put(), which advances it, and at the end to
  /// end_run().
  SymbolStep* begin_run(size_t value_count) {
    if (steps_.size() < step_count_ + value_count)
      steps_.resize(std::max(2 * steps_.size(), step_count_ + value_count));
    return steps_.data() + step_count_;
  }
  STRANDCAST_LANES void put(uint32_t folded, SymbolTable& table, uint32_t shift, SymbolStep*& next) {
    const uint32_t value = folded >> shift;
    uint32_t symbol = value;
    if (value >= kFirstTail) [[unlikely]]
      symbol = put_tail(value);
    // Two entries side by side, for all symbols but the last.
    if (symbol + 1 < kSymbolCount) [[likely]]
      std::memcpy(next, &table.start[symbol], sizeof *next);
    else
      *next = {static_cast<uint16_t>(table.start[symbol]), static_cast<uint16_t>(kProbabilityOne)};
    ++next;
    table.learn(symbol);
    if (shift != 0) [[unlikely]]
      put_bits(folded & ((1u << shift) - 1u), shift);
  }
  void end_run(const SymbolStep* next) { step_count_ = static_cast<size_t>(next - steps_.data()); }

  /// Appends two u32 lengths, the symbols' words and the plain bits, and resets the writer.
  void finish(std::vector<std::byte>& destination);
  /// Does the same for several writers in less time, because their rANS states are independent.
  static void finish_all(std::span<ValueWriter> writers, std::span<std::vector<std::byte>> destinations);

 private:
  /// Decodes and returns the next symbol.
  uint32_t put_tail(uint32_t value) {
    uint32_t symbol = kFirstTail;
    while (symbol + 1 < kSymbolCount && value >= kTailBegin[symbol + 1 - kFirstTail]) ++symbol;
    const uint32_t beyond = value - kTailBegin[symbol - kFirstTail];
    if (symbol + 1 < kSymbolCount) {
      put_bits(beyond, kTailBits[symbol - kFirstTail]);
    } else {
      const auto length = static_cast<uint32_t>(std::bit_width(beyond + 1)) - 1;
      put_bits(length, kLengthBits);
      put_bits(beyond + 1 - (1u << length), length);
    }
    return symbol;
  }
  class Packer;
  void append_to(std::vector<std::byte>& destination, std::span<const uint16_t> words);

  std::vector<SymbolStep> steps_;  // the first step_count_ count
  size_t step_count_ = 0;
  std::vector<uint16_t> words_;  // lent to a packer
  std::vector<std::byte> bits_;
  uint64_t pending_ = 0;
  uint32_t pending_count_ = 0;
};

/// State of a reader during a run of symbols.
struct SymbolCursor {
  uint32_t state;
  const uint16_t* next;

  /// Decodes the next symbol of `table`, which adapts.
  STRANDCAST_LANES uint32_t take(SymbolTable& table) {
    const auto place = static_cast<int32_t>(state & (kProbabilityOne - 1));
    const uint32_t symbol = find_symbol(table, place);
    pass(table, symbol, place, table.start[symbol], static_cast<uint32_t>(table.share(symbol)));
    return symbol;
  }
  /// Consumes a 0 if it is next and returns whether it was. Where 0 is likely, a predicted branch is faster
  /// than a table search.
  STRANDCAST_LANES bool take_zero(SymbolTable& table) {
    const auto place = static_cast<int32_t>(state & (kProbabilityOne - 1));
    const int32_t share = table.start[1];
    if (place >= share) [[unlikely]]
      return false;
    pass(table, 0, place, 0, static_cast<uint32_t>(share));
    return true;
  }

 private:
  STRANDCAST_LANES void pass(SymbolTable& table, uint32_t symbol, int32_t place, int32_t start,
                             uint32_t share) {
    state = share * (state >> kProbabilityBits) + static_cast<uint32_t>(place - start);
    if (state < kRansLow) state = state << 16 | *next++;
    table.learn(symbol);
  }
};

/// Reads one slice from untrusted bytes: any bytes give some values; call is_spent() afterwards.
class ValueReader {
 public:
  /// Takes the slice from the front of `source` and returns the remaining bytes. `source` must outlive the
  /// reader.
  Result<std::span<const std::byte>> open(std::span<const std::byte> source);

  uint32_t take(SymbolTable& table, uint32_t shift) {
    SymbolCursor cursor = begin_run(1);
    const uint32_t symbol = cursor.take(table);
    end_run(cursor);
    return value_of(symbol, shift);
  }
  uint32_t take_bits(uint32_t count);
  /// Returns true if exactly the bytes of the slice were read.
  bool is_spent() const;
  /// Returns true if more was read than the slice holds; values since then are meaningless.
  bool is_short() const { return is_short_; }

  /// Begins a run of at most `symbol_count` symbols. value_of() turns them into values; end_run() takes the
  /// cursor back.
  SymbolCursor begin_run(size_t symbol_count);
  STRANDCAST_LANES uint32_t value_of(uint32_t symbol, uint32_t shift) {
    uint32_t value = symbol;
    if (symbol >= kFirstTail) [[unlikely]]
      value = take_tail(symbol);
    if (shift != 0) [[unlikely]]
      value = (value << shift) | take_bits(shift);
    return value;
  }
  void end_run(const SymbolCursor& cursor);

 private:
  uint32_t take_tail(uint32_t symbol);

  std::vector<uint16_t> words_;  // of the slice, then zeros for what hostile bytes ask for
  size_t word_count_ = 0;
  size_t next_word_ = 0;
  bool has_half_word_ = false;
  std::span<const std::byte> bits_;
  uint64_t pending_ = 0;
  uint32_t pending_count_ = 0;
  uint32_t state_ = kRansLow;
  bool is_short_ = false;
};

}  // namespace strandcast

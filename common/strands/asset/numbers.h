// Numbers of an asset of layout 2, written and read by the same calls: rANS with one table for each expected
// size (common/strands/value_coder.h). Integers only. Header only; one object per part.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "common/strands/value_coder.h"

namespace strandcast::asset {

inline constexpr uint32_t kExpectedSizes = 30;  // of numbers, in bits
inline constexpr uint32_t kNumberKinds = 4;     // of numbers that share no tables
/// Bits of an expected size that the symbol tells; those below are plain.
inline constexpr uint32_t kToldBits = 2;

/// A table whose shares are all alike.
inline SymbolTable even_table() {
  SymbolTable table;
  for (uint32_t k = 0; k < kSymbolCount; ++k)
    table.start[k] = static_cast<int16_t>(k << (kProbabilityBits - 4));
  return table;
}

/// Tables of one part.
class PartTables {
 public:
  PartTables() {
    for (auto& kind : tables_) kind.fill(even_table());
  }

 protected:
  /// Returns the size class of numbers about as large as `expected`.
  static uint32_t size_of(uint32_t expected) {
    return std::min(static_cast<uint32_t>(std::bit_width(expected)), kExpectedSizes - 1);
  }
  static uint32_t shift_of(uint32_t size) { return size > kToldBits ? size - kToldBits : 0; }

  std::array<std::array<SymbolTable, kExpectedSizes>, kNumberKinds> tables_;
};

class NumberWriter : PartTables {
 public:
  static constexpr bool kReads = false;

  void code(int32_t& value, uint32_t kind, uint32_t expected) {
    const uint32_t size = size_of(expected);
    writer_.put(fold_sign(value), tables_[kind][size], shift_of(size));
  }
  void code_bits(uint32_t& value, uint32_t count) { writer_.put_bits(value, count); }
  /// Codes a number below kSymbolCount by a table of the caller's.
  void code_symbol(uint32_t& symbol, SymbolTable& table) { writer_.put(symbol, table, 0); }
  bool is_short() const { return false; }
  void finish(std::vector<std::byte>& destination) { writer_.finish(destination); }

 private:
  ValueWriter writer_;
};

/// Reads untrusted bytes: any of them give some numbers.
class NumberReader : PartTables {
 public:
  static constexpr bool kReads = true;

  /// `reader` is open and outlives this object.
  explicit NumberReader(ValueReader& reader) : reader_(reader) {}
  void code(int32_t& value, uint32_t kind, uint32_t expected) {
    const uint32_t size = size_of(expected);
    value = unfold_sign(reader_.take(tables_[kind][size], shift_of(size)));
  }
  void code_bits(uint32_t& value, uint32_t count) { value = reader_.take_bits(count); }
  void code_symbol(uint32_t& symbol, SymbolTable& table) { symbol = reader_.take(table, 0); }
  bool is_short() const { return reader_.is_short(); }

 private:
  ValueReader& reader_;
};

/// The size of a number for those that are expected to be alike; saturates.
inline uint32_t magnitude(int32_t value) {
  return std::min(fold_sign(value) >> 1, 1u << 28);
}

}  // namespace strandcast::asset

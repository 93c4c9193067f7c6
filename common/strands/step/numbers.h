// Codes integers of states and models with tables chosen by the size of the preceding integers. Header only;
// private to common/strands/step. One object per stream and side.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include "common/strands/value_coder.h"

namespace strandcast::step {

class NumberTables {
 public:
  NumberTables() {
    SymbolTable first;
    double begin = 0.0;
    double share = kFirstShare;
    for (uint32_t k = 0; k < kSymbolCount; ++k) {
      first.start[k] = static_cast<int16_t>(begin * kProbabilityOne);
      begin += share;
      share *= kFading;
    }
    tables_.fill(first);
  }
  // Many at a time, as of ValueWriter and ValueReader.
  STRANDCAST_LANES void put(int32_t value, ValueWriter& writer, SymbolStep*& next) {
    const uint32_t folded = fold_sign(value);
    const uint32_t size = expected_size();
    writer.put(folded, tables_[size], shift_of(size), next);
    remember(folded);
  }
  STRANDCAST_LANES int32_t take(ValueReader& reader, SymbolCursor& cursor) {
    const uint32_t size = expected_size();
    const uint32_t folded = reader.value_of(cursor.take(tables_[size]), shift_of(size));
    remember(folded);
    return unfold_sign(folded);
  }
  /// A number by the sum of about five sizes beside it, instead of the preceding ones.
  void put_beside(int32_t value, uint32_t sum, ValueWriter& writer) {
    const uint32_t size = size_beside(sum);
    SymbolStep* next = writer.begin_run(1);
    writer.put(fold_sign(value), tables_[size], shift_beside(size), next);
    writer.end_run(next);
  }
  int32_t take_beside(uint32_t sum, ValueReader& reader) {
    const uint32_t size = size_beside(sum);
    SymbolCursor cursor = reader.begin_run(1);
    const uint32_t folded = reader.value_of(cursor.take(tables_[size]), shift_beside(size));
    reader.end_run(cursor);
    return unfold_sign(folded);
  }
  void put(int32_t value, ValueWriter& writer) {
    SymbolStep* next = writer.begin_run(1);
    put(value, writer, next);
    writer.end_run(next);
  }
  int32_t take(ValueReader& reader) {
    SymbolCursor cursor = reader.begin_run(1);
    const int32_t value = take(reader, cursor);
    reader.end_run(cursor);
    return value;
  }

 private:
  static constexpr uint32_t kSizes = 24;
  static constexpr double kFirstShare = 0.15;  // fading so, sixteen shares are all
  static constexpr double kFading = 0.86;

  uint32_t expected_size() const {
    return std::min<uint32_t>(static_cast<uint32_t>(std::bit_width(before_ + last_)), kSizes - 1);
  }
  static uint32_t size_beside(uint32_t sum) {
    return std::min<uint32_t>(static_cast<uint32_t>(std::bit_width(sum)), kSizes - 1);
  }
  static uint32_t shift_beside(uint32_t size) { return size > 5 ? size - 5 : 0; }
  static uint32_t shift_of(uint32_t size) { return size > 4 ? size - 4 : 0; }
  void remember(uint32_t folded) {
    constexpr uint32_t kMost = 1u << 30;
    before_ = last_;
    last_ = std::min(folded, kMost);
  }

  std::array<SymbolTable, kSizes> tables_;
  uint32_t before_ = 0;
  uint32_t last_ = 0;
};

}  // namespace strandcast::step

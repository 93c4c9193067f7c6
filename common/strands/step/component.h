// What of a predictor's state is coded: a component of the strands of a slice, and vectors of blocks by
// place. Header only; private to common/strands/step.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "common/kernels/strand_blocks.h"
#include "common/strands/step/lanes.h"
#include "common/strands/step/numbers.h"
#include "common/strands/tangent/layout.h"
#include "common/strands/wrapping.h"

namespace strandcast::step {

/// One component of the strands of a slice, in steps, told beside what the vertex before has and how the two
/// neighbours (in the first block the strand before, alone) go on from there.
class Component {
 public:
  /// What a slice leaves to the next one.
  struct Kept {
    NumberTables tables;
    size_t first = 0;                  // place of the first strand, which follows zeros
    std::vector<int32_t> values = {};  // from these zeros on
    bool is_fine = false;              // tables are chosen by sizes beside, not by the last ones
    std::vector<uint32_t> sizes = {};  // as values, of what they are beside what is expected
  };

  /// Slices in turn share what is kept; neighbours may then be of any of them.
  Component(const tangent::Layout& layout, const tangent::Neighbours& beside, uint32_t slice,
            uint32_t vertex_count, Kept& kept)
      : tables_(kept.tables),
        layout_(layout),
        beside_(beside),
        begin_(layout.slice_begin[slice]),
        vertex_count_(vertex_count),
        kept_(kept) {
    if (kept.values.empty()) kept.first = begin_;
    kept.values.resize((begin_ + layout.strands_in[slice] + 1 - kept.first) * vertex_count);
    if (kept.is_fine) kept.sizes.resize(kept.values.size());
  }

  /// One strand; value_at(v) gives what it has there.
  template <class ValueAt>
  void put_strand(size_t place, ValueWriter& writer, ValueAt value_at) {
    if (kept_.is_fine)
      return visit(place, [&](uint32_t v, int32_t expected) {
        const int32_t value = value_at(v);
        const int32_t apart = wrapping_difference(value, expected);
        tables_.put_beside(apart, size_beside(place, v), writer);
        keep_size(place, v, apart);
        return value;
      });
    SymbolStep* next = writer.begin_run(vertex_count_);
    visit(place, [&](uint32_t v, int32_t expected) {
      const int32_t value = value_at(v);
      tables_.put(wrapping_difference(value, expected), writer, next);
      return value;
    });
    writer.end_run(next);
  }
  template <class Give>
  void take_strand(size_t place, ValueReader& reader, Give give) {
    if (kept_.is_fine)
      return visit(place, [&](uint32_t v, int32_t expected) {
        const int32_t apart = tables_.take_beside(size_beside(place, v), reader);
        const int32_t value = wrapping_sum(expected, apart);
        keep_size(place, v, apart);
        give(v, value);
        return value;
      });
    SymbolCursor cursor = reader.begin_run(vertex_count_);
    visit(place, [&](uint32_t v, int32_t expected) {
      const int32_t value = wrapping_sum(expected, tables_.take(reader, cursor));
      give(v, value);
      return value;
    });
    reader.end_run(cursor);
  }

 private:
  size_t row_of(size_t place) const { return (place + 1 - kept_.first) * vertex_count_; }
  /// Where a neighbour's values begin; without one, those of the strand before.
  size_t row_beside(size_t i, size_t place) const {
    const size_t near = beside_[i][place];
    if (near != layout_.no_neighbour()) return row_of(near);
    return place == begin_ ? 0 : row_of(place - 1);
  }
  uint32_t size_beside(size_t place, uint32_t v) const {
    const uint32_t* const own = kept_.sizes.data() + row_of(place);
    uint32_t sum = kept_.sizes[row_beside(0, place) + v] + kept_.sizes[row_beside(1, place) + v];
    if (v >= 1) sum += 2 * own[v - 1];
    return v >= 2 ? sum + own[v - 2] : sum;
  }
  void keep_size(size_t place, uint32_t v, int32_t apart) {
    kept_.sizes[row_of(place) + v] = fold_sign(apart);
  }
  template <class Code>
  void visit(size_t place, Code code) {
    std::array<const int32_t*, 2> beside;
    for (size_t i = 0; i < beside.size(); ++i) beside[i] = kept_.values.data() + row_beside(i, place);
    int32_t* const own = kept_.values.data() + row_of(place);
    for (uint32_t v = 0; v < vertex_count_; ++v) {
      int64_t way = int64_t{beside[0][v]} + beside[1][v];
      if (v > 0) way -= int64_t{beside[0][v - 1]} + beside[1][v - 1];
      const auto expected = static_cast<int32_t>(way / 2 + (v == 0 ? 0 : own[v - 1]));
      own[v] = code(v, expected);
    }
  }

  NumberTables& tables_;
  const tangent::Layout& layout_;
  const tangent::Neighbours& beside_;
  size_t begin_;
  uint32_t vertex_count_;
  Kept& kept_;
};

inline float at(const StrandBlocks& blocks, size_t place, uint32_t v, uint32_t axis) {
  return blocks.row(static_cast<uint32_t>(place / kBlockStrands), v, axis)[place % kBlockStrands];
}
inline float& at(StrandBlocks& blocks, size_t place, uint32_t v, uint32_t axis) {
  return blocks.row(static_cast<uint32_t>(place / kBlockStrands), v, axis)[place % kBlockStrands];
}
inline glm::vec3 vector_at(const StrandBlocks& blocks, size_t place, uint32_t v) {
  return {at(blocks, place, v, 0), at(blocks, place, v, 1), at(blocks, place, v, 2)};
}
inline float dot_of(const glm::vec3& a, const glm::vec3& b) {
  return (a.x * b.x + a.y * b.y) + a.z * b.z;
}

}  // namespace strandcast::step

// StrandBlocks: one vector per vertex in blocks of 16 strands, the order in which SIMD lanes take them:
// (blocks x vertex_count x 4 x 16) floats, the components x y z w of 16 neighbouring strands behind each
// other. Strands beyond the last one of the last block are copies of that one. Plain data.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <new>
#include <span>

namespace strandcast {

inline constexpr uint32_t kBlockStrands = 16;
inline constexpr size_t kBlockRowFloats = 4 * kBlockStrands;  // of one vertex
inline constexpr size_t kBlockAlignment = 64;                 // bytes; of every row of 16 floats

inline uint32_t block_count(uint32_t strand_count) {
  return (strand_count + kBlockStrands - 1) / kBlockStrands;
}

/// Somebody else's blocks, to be read.
struct StrandBlocksView {
  const float* values = nullptr;
  uint32_t strand_count = 0;
  uint32_t row_count = 0;  // vertices of a strand

  /// 16 floats: component `axis` of that vertex in each strand of the block.
  const float* row(uint32_t block, uint32_t vertex, uint32_t axis) const {
    return values + (static_cast<size_t>(block) * row_count + vertex) * kBlockRowFloats +
           axis * kBlockStrands;
  }
};

/// Owned blocks; zero at first.
class StrandBlocks {
 public:
  StrandBlocks() = default;
  StrandBlocks(uint32_t strand_count, uint32_t row_count)
      : strand_count_(strand_count), row_count_(row_count), values_(make(size())) {}

  uint32_t strand_count() const { return strand_count_; }
  uint32_t row_count() const { return row_count_; }
  size_t size() const { return size_t{block_count(strand_count_)} * row_count_ * kBlockRowFloats; }  // floats
  float* data() { return values_.get(); }
  const float* data() const { return values_.get(); }
  const float* row(uint32_t block, uint32_t vertex, uint32_t axis) const {
    return view().row(block, vertex, axis);
  }
  float* row(uint32_t block, uint32_t vertex, uint32_t axis) {
    return data() + (static_cast<size_t>(block) * row_count_ + vertex) * kBlockRowFloats +
           axis * kBlockStrands;
  }
  StrandBlocksView view() const { return {data(), strand_count_, row_count_}; }

 private:
  struct Free {
    void operator()(float* values) const { ::operator delete[](values, std::align_val_t{kBlockAlignment}); }
  };
  static std::unique_ptr<float[], Free> make(size_t count) {
    auto* values =
        static_cast<float*>(::operator new[](count * sizeof(float), std::align_val_t{kBlockAlignment}));
    for (size_t i = 0; i < count; ++i) values[i] = 0.0f;
    return std::unique_ptr<float[], Free>(values);
  }

  uint32_t strand_count_ = 0;
  uint32_t row_count_ = 0;
  std::unique_ptr<float[], Free> values_;
};

/// Fills all of the blocks from (row_count x strand_count) values, the strand fastest; w of a vec3 is 0.
void pack_blocks(std::span<const glm::vec3> values, StrandBlocks& blocks);
void pack_blocks(std::span<const glm::vec4> values, StrandBlocks& blocks);

}  // namespace strandcast

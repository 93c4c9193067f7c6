#include "common/kernels/strand_blocks.h"

#include <algorithm>

#include "common/base/check.h"

namespace strandcast {
namespace {

template <class Vector>
void pack(std::span<const Vector> values, StrandBlocks& blocks) {
  const uint32_t strand_count = blocks.strand_count();
  CHECK(values.size() == size_t{strand_count} * blocks.row_count());
  const uint32_t block_end = block_count(strand_count);
  for (uint32_t row = 0; row < blocks.row_count(); ++row) {
    const Vector* from = values.data() + size_t{row} * strand_count;
    for (uint32_t block = 0; block < block_end; ++block) {
      float* to = blocks.row(block, row, 0);
      for (uint32_t lane = 0; lane < kBlockStrands; ++lane) {
        const Vector& value = from[std::min(block * kBlockStrands + lane, strand_count - 1)];
        for (int axis = 0; axis < Vector::length(); ++axis) to[axis * kBlockStrands + lane] = value[axis];
        for (int axis = Vector::length(); axis < 4; ++axis) to[axis * kBlockStrands + lane] = 0.0f;
      }
    }
  }
}

}  // namespace

void pack_blocks(std::span<const glm::vec3> values, StrandBlocks& blocks) {
  pack(values, blocks);
}

void pack_blocks(std::span<const glm::vec4> values, StrandBlocks& blocks) {
  pack(values, blocks);
}

}  // namespace strandcast

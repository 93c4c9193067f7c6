// What the predictor does with all vertices, a block of strands at a time: from its floats to the lattice,
// and back from what was decoded. Private to common/strands/step; the same bits from every instruction set.
#pragma once

#include <array>
#include <cstdint>

#include "common/kernels/strand_blocks.h"
#include "common/simd/variants.h"
#include "common/strands/tangent/motion.h"

namespace strandcast::step {

/// Rows of a matrix.
using Turn = std::array<std::array<float, 3>, 3>;

struct ExpectWork {
  const tangent::Layout& layout;
  const StrandBlocks& position_m;  // world axes
  Turn head_from_world;
  float quantum_m;
  tangent::Planes<int32_t>& lattice;
  uint32_t block_begin;
  uint32_t block_end;
};
void expect_blocks(simd::InstructionSet set, const ExpectWork& work);

struct CorrectWork {
  const tangent::Layout& layout;
  const tangent::Planes<int32_t>& expected;
  const tangent::Planes<int32_t>& decoded;
  Turn world_from_head;
  float quantum_m;
  float per_second;     // velocity gained by a correction, per metre
  uint32_t free_begin;  // vertices that are not pinned
  uint32_t free_end;
  StrandBlocks& position_m;
  StrandBlocks& velocity_mps;
  // What a model keeps of the last step; null = it does not.
  StrandBlocks* way_m;
  StrandBlocks* velocity_change_mps;
  StrandBlocks* axis;  // of the segment before each vertex
  uint32_t block_begin;
  uint32_t block_end;
};
void correct_blocks(simd::InstructionSet set, const CorrectWork& work);

}  // namespace strandcast::step

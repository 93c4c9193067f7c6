// What is done with the strands of a block that is published, in one walk while they are in cache: are their
// numbers usable, are they stretched, where are they in head space and on the lattice. Any thread; the same
// bits from every instruction set.
#pragma once

#include <array>
#include <cstdint>

#include "common/kernels/strand_blocks.h"
#include "common/simd/variants.h"

namespace strandcast {

/// Of the strands of a block.
struct BlockFindings {
  std::array<int32_t, kBlockStrands> bad_vertices{};  // without a usable position or velocity
  /// Segments that are longer than longest_squared_m2 says, or have no length that is a number.
  std::array<int32_t, kBlockStrands> stretched_segments{};
  bool has_bad = false;
  bool has_stretched = false;
};

struct BlockQuantise {
  StrandBlocksView position_m;  // world axes
  StrandBlocksView velocity_mps;
  float reach_m = 0.0f;  // farther from the head along an axis no position is usable
  /// (blocks x vertex_count x 16) for the segment before each vertex; nullptr: stretch is not looked at.
  const float* longest_squared_m2 = nullptr;
  /// Columns of the rotation.
  std::array<std::array<double, 3>, 3> head_from_world{};
  float quantum_m = 0.0f;
  BlockFindings* findings = nullptr;  // (blocks)
  /// (3 x vertex_count x strand_count) as Snapshot::lattice: what quantise() of common/strands/snapshot.h
  /// gives for the same positions. Of a strand with bad vertices any number.
  int32_t* lattice = nullptr;
};

struct BlockRange {
  const BlockQuantise* work = nullptr;
  uint32_t begin = 0;  // blocks
  uint32_t end = 0;
};

void quantise_blocks(simd::InstructionSet set, const BlockRange& range);

}  // namespace strandcast

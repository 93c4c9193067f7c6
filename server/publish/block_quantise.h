// Processes the strands of a block in one pass while they are in cache: checks their numbers and stretch, and
// converts positions to head space and to the lattice. Any thread; the same bits from every instruction set.
#pragma once

#include <array>
#include <cstdint>

#include "common/kernels/strand_blocks.h"
#include "common/simd/variants.h"

namespace strandcast {

/// Results of the checks for each strand of a block.
struct BlockFindings {
  std::array<int32_t, kBlockStrands> bad_vertices{};  // without a usable position or velocity
  /// Segments that exceed longest_squared_m2 or whose length is not finite.
  std::array<int32_t, kBlockStrands> stretched_segments{};
  bool has_bad = false;
  bool has_stretched = false;
};

struct BlockQuantise {
  StrandBlocksView position_m;  // world axes
  StrandBlocksView velocity_mps;
  float reach_m = 0.0f;  // farther from the head along an axis no position is usable
  /// Squared limit of the segment before each vertex, (blocks x vertex_count x 16); nullptr: stretch is not
  /// checked.
  const float* longest_squared_m2 = nullptr;
  /// Columns of the rotation.
  std::array<std::array<double, 3>, 3> head_from_world{};
  float quantum_m = 0.0f;
  BlockFindings* findings = nullptr;  // (blocks)
  /// Output, (3 x vertex_count x strand_count) as Snapshot::lattice; equals quantise() of
  /// common/strands/snapshot.h. Values of strands with bad vertices are arbitrary.
  int32_t* lattice = nullptr;
};

struct BlockRange {
  const BlockQuantise* work = nullptr;
  uint32_t begin = 0;  // blocks
  uint32_t end = 0;
};

void quantise_blocks(simd::InstructionSet set, const BlockRange& range);

}  // namespace strandcast

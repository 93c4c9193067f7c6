// Rest positions of strands as numbers: plain roots, then along each strand what a prediction leaves. It is
// made from the strand itself and two earlier ones with near roots. Exact: integers go in and come out. Pure
// functions, any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/strands/asset/lattice.h"

namespace strandcast::asset {

/// (strand_count x vertex_count) points of strands, one after the other.
struct StrandShape {
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;
  LatticePoints points;
};

/// Appends all strands.
void append_strands(const StrandShape& shape, std::vector<std::byte>& destination);

/// Reads what append_strands() wrote, from untrusted bytes; `shape` has its counts. BadInput where they are
/// damaged.
Status read_strands(std::span<const std::byte> source, StrandShape& shape);

}  // namespace strandcast::asset

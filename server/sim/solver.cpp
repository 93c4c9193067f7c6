#include "server/sim/solver.h"

#include "common/base/check.h"

namespace strandcast {
namespace {

StrandBlocksView packed(std::span<const glm::vec3> values, uint32_t strand_count, StrandBlocks& blocks) {
  CHECK(strand_count > 0);
  const auto row_count = static_cast<uint32_t>(values.size() / strand_count);
  if (blocks.strand_count() != strand_count || blocks.row_count() != row_count)
    blocks = StrandBlocks(strand_count, row_count);
  pack_blocks(values, blocks);
  return blocks.view();
}

}  // namespace

SolverBlocks Solver::read_blocks() {
  read(read_state_);
  return {packed(read_state_.position_m, strand_count(), position_m_in_blocks_),
          packed(read_state_.velocity_mps, strand_count(), velocity_mps_in_blocks_)};
}

}  // namespace strandcast

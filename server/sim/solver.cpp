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

HeadMotion head_motion(const Pose& from, const Pose& to, double passed_s) {
  HeadMotion motion;
  motion.velocity_mps = (to.position_m - from.position_m) / passed_s;
  glm::dquat turn = to.rotation * glm::inverse(from.rotation);
  if (turn.w < 0.0) turn = -turn;
  const double angle_rad = glm::angle(turn);
  if (angle_rad > 0.0) motion.spin_radps = glm::axis(turn) * (angle_rad / passed_s);
  return motion;
}

void move_with_head(Solver& solver, const HeadMotion& motion) {
  SolverState state;
  solver.read(state);
  for (size_t i = 0; i < state.velocity_mps.size(); ++i)
    state.velocity_mps[i] =
        glm::vec3(motion.velocity_mps + glm::cross(motion.spin_radps, glm::dvec3(state.position_m[i])));
  solver.write(state);
}

}  // namespace strandcast

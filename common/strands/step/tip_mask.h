// TipMask: of strands some of whose tips are pinned and others free, lets kernels act on one kind only, as
// the simulation does (server/sim/mixed_tips.h); and what tells the kinds on the wire. Private to
// common/strands/step; one thread.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/kernels/lane_program.h"
#include "common/kernels/strand_passes.h"
#include "common/strands/byte_io.h"

namespace strandcast::step {

/// Whether the tail of each strand is pinned, a bit each. BadInput where they are cut off.
void write_tails(std::span<const uint8_t> has_tail, ByteWriter& to);
Result<std::vector<uint8_t>> read_tails(ByteReader& bytes, uint32_t strand_count);

class TipMask {
 public:
  using MovingPlanes = std::array<std::unique_ptr<StrandBlocks>, kPlaneRoleCount>;

  /// `has_tail` is of places, `moving` are the planes that kernels write. Unsupported if this build lacks the
  /// kernel.
  static Result<std::unique_ptr<TipMask>> make(std::span<const uint8_t> has_tail, const MovingPlanes& moving,
                                               simd::InstructionSet set, const LaneWork& work);

  /// Notes what strands of this kind have, and gives it back to them.
  void keep(Tips of, const StepBlock& step, const MovingPlanes& moving);
  void put_back(Tips of, const StepBlock& step, const MovingPlanes& moving);

 private:
  void copy(Tips of, const StepBlock& step, StrandBlocks& from, StrandBlocks& to);

  std::array<std::optional<LaneProgram>, 2> program_;  // by Tips
  std::unique_ptr<StrandBlocks> has_tail_;             // a row, x = 1: pinned
  MovingPlanes kept_;
};

}  // namespace strandcast::step

// BendLimit: the pass that keeps the angles between a strand's segments within limits after each substep of
// whatever model's kernel ran (shaders/sim/bend_limit.comp). Strands whose tip is held too are left alone:
// their lengths could not be kept. From the thread of its executor.
#pragma once

#include <memory>

#include "common/kernels/strand_passes.h"
#include "common/scene/scene_desc.h"
#include "server/sim/follicle_limit.h"

namespace strandcast {

BendAngles bend_angles(const BendLimitDesc& limits);

class BendLimit {
 public:
  /// As Executor::make_program().
  static Result<BendLimit> make(Executor& executor, const SceneFeatures& features, const StrandLayout& layout,
                                const CarriedPlanes& carried, const BendLimitDesc& limits);

  /// Whether strands of this layout are moved at all.
  static bool holds(const StrandLayout& layout) { return layout.pinned_tail_count == 0; }
  /// `strands`: the planes of the state.
  void run(const StepBlock& step, BoundPlanes strands, const CarriedPlanes& carried);
  uint64_t size_bytes() const { return program_->size_bytes(); }

 private:
  std::unique_ptr<KernelProgram> program_;
};

}  // namespace strandcast

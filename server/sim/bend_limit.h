// BendLimit: a pass that limits the angles between a strand's segments after each substep of any model
// (shaders/sim/bend_limit.comp). Strands with a pinned tip are not changed, because their lengths could not
// be kept. Runs on its executor's thread.
#pragma once

#include <memory>

#include "common/kernels/strand_passes.h"
#include "common/scene/scene_desc.h"
#include "server/sim/follicle_limit.h"

namespace strandcast {

BendAngles bend_angles(const BendLimitDesc& limits);

class BendLimit {
 public:
  /// Makes the pass; errors as Executor::make_program().
  static Result<BendLimit> make(Executor& executor, const SceneFeatures& features, const StrandLayout& layout,
                                const CarriedPlanes& carried, const BendLimitDesc& limits);

  /// Returns whether the pass moves strands of this layout.
  static bool holds(const StrandLayout& layout) { return layout.has_free_tips(); }
  /// Runs the pass after a substep; `strands` are the planes of the state.
  void run(const StepBlock& step, BoundPlanes strands, const CarriedPlanes& carried);
  uint64_t size_bytes() const { return program_->size_bytes(); }

 private:
  std::unique_ptr<KernelProgram> program_;
};

}  // namespace strandcast

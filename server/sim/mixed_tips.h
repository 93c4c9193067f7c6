// MixedTips: lets the kernels of a substep act on strands of one kind only, where some have free tips and
// others pinned ones. Everybody's kernels run once for each kind; the strands of the other kind then get back
// what they had. Costs a second run, and copies; what has one kind only pays nothing. Runs on its executor's
// thread.
#pragma once

#include <array>
#include <memory>

#include "common/kernels/strand_passes.h"
#include "server/sim/executor/executor.h"
#include "server/sim/strand_layout.h"

namespace strandcast {

class MixedTips {
 public:
  /// `moving` are the planes that kernels write, by role; their rows are vertices. Errors as
  /// Executor::make_program().
  static Result<MixedTips> make(Executor& executor, const SceneFeatures& features, const StrandLayout& layout,
                                const BoundPlanes& moving);

  /// Notes what strands of this kind have.
  void keep(Tips of, const StepBlock& step, const BoundPlanes& moving);
  /// Gives strands of this kind what keep() noted of them.
  void put_back(Tips of, const StepBlock& step, const BoundPlanes& moving);
  uint64_t size_bytes() const;

 private:
  void copy(Tips of, const StepBlock& step, StrandPlane& from, StrandPlane& to);

  std::array<std::unique_ptr<KernelProgram>, 2> program_;           // by Tips
  std::unique_ptr<StrandPlane> has_tail_;                           // (1 x strand_count) x = 1: pinned
  std::array<std::unique_ptr<StrandPlane>, kPlaneRoleCount> kept_;  // of `moving`
};

}  // namespace strandcast

// BodyCollider: a pass that keeps strands out of the body's capsules and planes after each substep of any
// model. Algorithm: shaders/sim/body_collider.comp; in double precision: reference_body.h. It runs before the
// pass of the head's distance field, which decides last. Strands with a pinned tip are not changed, because
// their lengths could not be kept. Runs on its executor's thread.
#pragma once

#include <memory>

#include "server/sim/follicle_limit.h"
#include "server/sim/strand_state.h"

namespace strandcast {

class BodyCollider {
 public:
  /// Makes the pass for the strands in their present state; its first run does not move them. Errors as
  /// Executor::make_program() and make_table().
  static Result<BodyCollider> make(Executor& executor, const SceneFeatures& features,
                                   const StrandState& strands, const CarriedPlanes& carried);

  /// Returns whether the pass moves strands of this layout.
  static bool holds(const StrandLayout& layout) {
    return layout.has_free_tips() && layout.pinned_root_count < layout.vertex_count;
  }
  /// Runs the pass after the substep `step`, which was made of `input`; `strands` are the planes of the
  /// state.
  void run(const StepBlock& step, const StepInput& input, BoundPlanes strands, const CarriedPlanes& carried);
  uint64_t size_bytes() const;

 private:
  std::unique_ptr<KernelProgram> program_;
  std::unique_ptr<LookupTable> table_;
  std::unique_ptr<StrandPlane>
      before_;  // (vertex_count x strand_count) head space, m; w = the clearance that a vertex has had
  bool is_new_ = true;
};

}  // namespace strandcast

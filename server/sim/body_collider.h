// BodyCollider: the pass that keeps strands out of the body's capsules and planes after each substep of
// whatever model's kernel ran (shaders/sim/body_collider.comp, which says how; in double: reference_body.h).
// Before the head's distance field, which has the last word. Strands whose tip is held too are left alone:
// their lengths could not be kept. From the thread of its executor.
#pragma once

#include <memory>

#include "server/sim/follicle_limit.h"
#include "server/sim/strand_state.h"

namespace strandcast {

class BodyCollider {
 public:
  /// For the strands as they are, which stay where they are in the first run. As Executor::make_program() and
  /// make_table().
  static Result<BodyCollider> make(Executor& executor, const SceneFeatures& features,
                                   const StrandState& strands, const CarriedPlanes& carried);

  /// Whether strands of this layout are moved at all.
  static bool holds(const StrandLayout& layout) {
    return layout.pinned_tail_count == 0 && layout.pinned_root_count < layout.vertex_count;
  }
  /// `strands`: the planes of the state, of which `step`, made of `input`, was a substep.
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

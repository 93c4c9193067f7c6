// FieldCollider: the pass that keeps strands out of the head's distance field after each substep of whatever
// model's kernel ran (shaders/sim/field_collider.comp, which says how; in double: reference_field.h). Behind
// the follicle limit, which turns roots: what it ends with is outside of the head. Strands whose tip is held
// too are left alone: their lengths could not be kept. From the thread of its executor.
#pragma once

#include <memory>

#include "common/groom/distance_field.h"
#include "server/sim/follicle_limit.h"
#include "server/sim/strand_state.h"

namespace strandcast {

class FieldCollider {
 public:
  /// For the strands as they are. As Executor::make_program() and make_table().
  static Result<FieldCollider> make(Executor& executor, const SceneFeatures& features,
                                    const StrandState& strands, const CarriedPlanes& carried,
                                    const DistanceField& field);

  /// Whether strands of this layout are moved at all.
  static bool holds(const StrandLayout& layout) {
    return layout.pinned_tail_count == 0 && layout.pinned_root_count < layout.vertex_count;
  }
  /// `strands`: the planes of the state, of which `step` was a substep.
  void run(const StepBlock& step, BoundPlanes strands, const CarriedPlanes& carried);
  uint64_t size_bytes() const;

 private:
  std::unique_ptr<KernelProgram> program_;
  std::unique_ptr<LookupTable> table_;
  std::unique_ptr<StrandPlane>
      before_;  // (vertex_count x strand_count) head space, m; after the last substep
};

}  // namespace strandcast

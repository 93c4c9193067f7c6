// FieldCollider: a pass that keeps strands out of the head's distance field after each substep of any model.
// Algorithm: shaders/sim/field_collider.comp; in double precision: reference_field.h. It runs after the
// follicle limit, which rotates roots, so that strands end outside the head. Strands with a pinned tip are
// not changed, because their lengths could not be kept. Runs on its executor's thread.
#pragma once

#include <memory>

#include "common/groom/distance_field.h"
#include "server/sim/follicle_limit.h"
#include "server/sim/strand_state.h"

namespace strandcast {

class FieldCollider {
 public:
  /// Makes the pass for the strands in their present state. Errors as Executor::make_program() and
  /// make_table().
  static Result<FieldCollider> make(Executor& executor, const SceneFeatures& features,
                                    const StrandState& strands, const CarriedPlanes& carried,
                                    const DistanceField& field);

  /// Returns whether the pass moves strands of this layout.
  static bool holds(const StrandLayout& layout) {
    return layout.has_free_tips() && layout.pinned_root_count < layout.vertex_count;
  }
  /// Runs the pass after the substep `step`; `strands` are the planes of the state.
  void run(const StepBlock& step, BoundPlanes strands, const CarriedPlanes& carried);
  uint64_t size_bytes() const;

 private:
  std::unique_ptr<KernelProgram> program_;
  std::unique_ptr<LookupTable> table_;
  std::unique_ptr<StrandPlane>
      before_;  // (vertex_count x strand_count) head space, m; after the last substep
};

}  // namespace strandcast

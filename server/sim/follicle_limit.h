// FollicleLimit: a pass that limits how far a strand's root leans from its groomed direction, after each
// substep of any model (shaders/sim/follicle_limit.comp). The rest of the strand moves along with its first
// free segment. Strands with a pinned tip are not changed, because their lengths could not be kept. Runs on
// its executor's thread.
#pragma once

#include <memory>

#include "server/sim/executor/executor.h"
#include "server/sim/solver.h"
#include "server/sim/strand_layout.h"

namespace strandcast {

/// Planes of a model that must be moved along when a pass moves strands; null = the model has none.
struct CarriedPlanes {
  StrandPlane* way = nullptr;   // of every vertex in the last substep; world, m
  StrandPlane* axis = nullptr;  // of every segment; world. Only with `way`

  int memory() const { return pass_memory(way != nullptr, axis != nullptr); }
};

class FollicleLimit {
 public:
  /// Makes the pass; errors as Executor::make_program().
  static Result<FollicleLimit> make(Executor& executor, const SceneFeatures& features,
                                    const StrandLayout& layout, const CarriedPlanes& carried);

  /// Returns whether the pass acts in this substep: the input has a limit and the strands have free tips.
  static bool holds(const StepInput& input, const StrandLayout& layout);
  /// Runs the pass after a substep; `strands` are the planes of the state.
  void run(const StepBlock& step, size_t collider_count, BoundPlanes strands, const CarriedPlanes& carried);
  uint64_t size_bytes() const { return program_->size_bytes(); }

 private:
  std::unique_ptr<KernelProgram> program_;
};

}  // namespace strandcast
